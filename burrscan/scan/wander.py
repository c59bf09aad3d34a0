"""How far light by way of other surfaces moves the columns, learnt from the scan itself.

The frequencies' contradictions show only that part of it which differs between them. The rest shows in
space: where there is such light, columns scatter about their neighbours by more than their sigmas say.
"""

from __future__ import annotations

import numpy as np
from scipy import stats

from burrscan.arrays import Floats, Floats32
from burrscan.scan.consistency import shifted

_LEAST_SHARE = 0.02
_LEAST_TO_LEARN = 400
_MOST_PX = 4.0
_HALF_NORMAL_MEDIAN = float(stats.norm.ppf(0.75))


def wander_px(u_px: Floats32, sigma_px: Floats32, lost: Floats32) -> float:
    """Standard deviation of a column, px, per unit of light by way of other surfaces per direct light.

    Parameters
    ----------
    u_px, sigma_px
        (h, w) columns and sigmas without such light, NaN where unknown.
    lost
        (h, w) how much of such light there is.

    Notes
    -----
    Second differences along rows and down columns, in which a smooth surface hardly shows, are brought to
    the median of the normal distribution by bisection. 0 where they are there already or where fewer than
    a few hundred pixels tell. O(pixels).

    """
    triples = _triples(u_px, sigma_px, lost)
    difference, variance, share = (np.concatenate(part) for part in zip(*triples, strict=True))
    if len(difference) < _LEAST_TO_LEARN or _median_z(difference, variance) <= _HALF_NORMAL_MEDIAN:
        return 0.0
    low, high = 0.0, _MOST_PX
    for _ in range(16):
        middle = 0.5 * (low + high)
        over = _median_z(difference, variance + middle * middle * share) > _HALF_NORMAL_MEDIAN
        low, high = (middle, high) if over else (low, middle)
    return high


def _triples(u_px: Floats32, sigma_px: Floats32, lost: Floats32) -> list[tuple[Floats, Floats, Floats]]:
    """Second differences, their variances, and the sum of squared weighted shares, in both directions."""
    weights = {-1: 1.0, 0: -2.0, 1: 1.0}
    found = []
    for rows, columns in ((0, 1), (1, 0)):
        difference, variance, share = np.zeros((3, *u_px.shape))
        for k, weight in weights.items():
            difference += weight * shifted(u_px, k * rows, k * columns)
            variance += (weight * shifted(sigma_px, k * rows, k * columns)) ** 2
            share += (weight * shifted(lost, k * rows, k * columns)) ** 2
        with np.errstate(invalid="ignore"):
            telling = np.isfinite(difference) & (lost > _LEAST_SHARE)
        found.append((difference[telling], variance[telling], share[telling]))
    return found


def _median_z(difference: Floats, variance: Floats) -> float:
    return float(np.median(np.abs(difference) / np.sqrt(variance)))
