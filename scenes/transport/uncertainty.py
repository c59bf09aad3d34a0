"""The standard error of each pixel's interreflected light."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Bools, Floats, Ints
from scenes.transport.neighbours import summed


def standard_error(variance: Floats, scatter: Floats, *, samples: Ints, pilot: int, seen: Bools) -> Floats:
    """Standard error (h, w) of the interreflected light, in its unit.

    For the pilot's independent paths it is the scatter of single paths over √n, pooled over the neighbours,
    for a few paths may all miss. A refined pixel's replicates show what its net gains over independent paths;
    two or three replicates show it roughly, so the gain is pooled over the refined neighbours.

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
    pooled = summed(independent, coarse) / np.maximum(summed(np.ones(seen.shape), coarse), 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        gain = np.nan_to_num(summed(scatter, refined) / summed(independent, refined))
    squared = np.where(refined, independent * gain, np.where(coarse, pooled, 0.0))
    return np.asarray(np.sqrt(squared))
