"""The standard error of each pixel's interreflected light."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Bools, Floats, Ints
from scenes.transport.neighbours import summed

_LEAST_FALL, _MOST_FALL = 2.0, 8.0
"""Of the variance, for twice the points: independent ones, and a net where the light is smooth (2^3, Owen
1997)."""


def standard_error(
    variance: Floats, halves: Floats, quarters: Floats, *, samples: Ints, pilot: int, seen: Bools
) -> Floats:
    """Standard error (h, w) of the interreflected light, in its unit.

    For the pilot's independent paths it is the scatter of single paths over √n, pooled over the neighbours,
    for a few paths may all miss. The halves of a net are not independent, each lies between the points of the
    other: where variance falls by a factor f for twice the points, half their squared difference over two
    has the mean V · (f - 1), V the variance of their mean, and what quarters say f times that. So f is the
    ratio of both. One pixel's parts show it roughly: the gain over independent paths is pooled over the
    refined neighbours.

    Parameters
    ----------
    variance
        (h, w) of one sample's light: of the pilot's, or of the refined pixels' own.
    halves, quarters
        (h, w) :class:`scenes.transport.arrivals.Gathered`; read where a pixel was refined.
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
        half, quarter = summed(halves, refined)[refined], summed(quarters, refined)[refined]
        fall = np.clip(quarter / half, _LEAST_FALL, _MOST_FALL)
        gain = np.nan_to_num(half / (fall - 1.0) / summed(mean, refined)[refined])
    error[refined] = mean[refined] * gain
    return np.asarray(np.sqrt(error, out=error))
