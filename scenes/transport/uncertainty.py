"""The standard error of each pixel's interreflected light."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from burrscan.arrays import Bools, Floats, Ints

_WINDOW = 5


def standard_error(variance: Floats, scatter: Floats, *, samples: Ints, pilot: int, seen: Bools) -> Floats:
    """Standard error (h, w) of the interreflected light, in its unit.

    For the pilot's independent paths it is the scatter of single paths over √n, pooled over the neighbours,
    for a few paths may all miss. A refined pixel's replicates show what its net gains over independent paths;
    four replicates show it roughly, so the gain is pooled over the refined neighbours.

    Parameters
    ----------
    variance
        (h, w) of one sample's light: of the pilot's, or of the refined pixels' own.
    scatter
        (h, w) variance of the mean by the replicates; read where a pixel was refined.
    samples
        (h, w) of the refinement, 0 where there was none.
    pilot
        Samples of the pilot.
    seen
        (h, w) pixels that were traced; the others have error 0.

    """
    refined = samples > 0
    independent = variance / np.where(refined, samples, pilot)
    coarse = seen & ~refined
    pooled = _summed(independent, coarse) / np.maximum(_summed(np.ones(seen.shape), coarse), 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        gain = np.nan_to_num(_summed(scatter, refined) / _summed(independent, refined))
    squared = np.where(refined, independent * gain, np.where(coarse, pooled, 0.0))
    return np.asarray(np.sqrt(squared))


def _summed(values: Floats, where: Bools) -> Floats:
    """Sum over each pixel's 5 × 5 neighbourhood of the values that count."""
    kernel = np.ones((_WINDOW, _WINDOW))
    return np.asarray(ndimage.convolve(np.where(where, values, 0.0), kernel, mode="constant"))
