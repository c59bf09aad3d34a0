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
    coarse = seen & ~refined
    mean, one = np.zeros(seen.shape), np.ones(seen.shape)
    mean[refined] = variance[refined] / samples[refined]
    mean[coarse] = variance[coarse] / pilot
    error = np.zeros(seen.shape)
    error[coarse] = summed(mean, coarse)[coarse] / summed(one, coarse)[coarse]
    with np.errstate(divide="ignore", invalid="ignore"):
        gain = np.nan_to_num(summed(scatter, refined)[refined] / summed(mean, refined)[refined])
    error[refined] = mean[refined] * gain
    return np.asarray(np.sqrt(error, out=error))
