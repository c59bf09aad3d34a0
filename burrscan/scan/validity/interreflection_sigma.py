"""How far interreflected light moves the columns, learnt from the scan itself.

The frequencies' contradictions show only that part of it which differs between them. The rest shows in
space: where there is such light, columns scatter about their neighbours by more than their sigmas say.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import uniform_filter
from scipy.special import ndtri

from burrscan.arrays import Floats, Floats32
from burrscan.shifted import shifted

_SHARES = (0.02, 0.1, 0.3, 1.0, 3.0)
"""Of light lost to the stripes, even in its logarithm: classes whose deviation per share is learnt apart;
below the first it is noise."""
_LEAST_TO_LEARN = 400
"""Second differences: the median of so many is known to 6 %."""
_MOST_PX = 4.0
"""End of the bisection, deviation per share; 16 halvings leave 1e-4 px."""
_REACH_PX = 2
"""Of the second differences: far enough that light which bounces differs, near enough that a surface bends
alike."""
_AROUND_PX = 11
"""Width of the square around a pixel in which it does. On a cylinder of 90 mm under 1.5 mm pixels its bend
made the deviation a fifth too large."""
_HALF_NORMAL_MEDIAN = float(ndtri(0.75))
"""Median size of a normal variable, in its standard deviations."""


def interreflection_sigma_px(u_px: Floats32, sigma_px: Floats32, lost: Floats32) -> Floats32:
    """Standard deviation (h, w) of the columns by interreflected light, px.

    Parameters
    ----------
    u_px, sigma_px
        (h, w) columns and sigmas without such light, NaN where unknown.
    lost
        (h, w) how much of such light there is per direct light.

    Notes
    -----
    In each of a few classes of ``lost`` the deviation is proportional to it. Second differences over a few
    pixels along rows and down columns, less what neighbours share of them, which is the surface's, are
    brought to the median of the normal distribution by bisection. A class in which fewer than some hundred
    of them tell takes the next lower one's. O(pixels).

    """
    triples = _triples(u_px, sigma_px, lost)
    difference, variance, share, at = (np.concatenate(part) for part in zip(*triples, strict=True))
    per_share, found = np.zeros(len(_SHARES) + 1), 0.0
    of_triple = np.digitize(at, _SHARES)
    for number in range(1, len(per_share)):
        mine = of_triple == number
        if np.count_nonzero(mine) >= _LEAST_TO_LEARN:
            found = _per_share_px(difference[mine], variance[mine], share[mine])
        per_share[number] = found
    sigma: Floats32 = (per_share[np.digitize(np.nan_to_num(lost), _SHARES)] * lost).astype(np.float32)
    return sigma


def _per_share_px(difference: Floats, variance: Floats, share: Floats) -> float:
    """The deviation per share that explains the differences; 0 where their sigmas do already."""
    if _median_z(difference, variance) <= _HALF_NORMAL_MEDIAN:
        return 0.0
    low, high = 0.0, _MOST_PX
    for _ in range(16):
        middle = 0.5 * (low + high)
        over = _median_z(difference, variance + middle * middle * share) > _HALF_NORMAL_MEDIAN
        low, high = (middle, high) if over else (low, middle)
    return high


def _triples(u_px: Floats32, sigma_px: Floats32, lost: Floats32) -> list[tuple[Floats, ...]]:
    """Second differences, their variances, the sums of squared weighted shares, and the middle's share."""
    weights = {-1: 1.0, 0: -2.0, 1: 1.0}
    found: list[tuple[Floats, ...]] = []
    for rows, columns in ((0, _REACH_PX), (_REACH_PX, 0)):
        difference, variance, share = np.zeros((3, *u_px.shape))
        for k, weight in weights.items():
            difference += weight * shifted(u_px, k * rows, k * columns)
            variance += (weight * shifted(sigma_px, k * rows, k * columns)) ** 2
            share += (weight * shifted(lost, k * rows, k * columns)) ** 2
        difference -= _bend(difference)
        with np.errstate(invalid="ignore"):
            telling = np.isfinite(difference) & (lost > _SHARES[0])
        found.append((difference[telling], variance[telling], share[telling], lost[telling]))
    return found


def _bend(difference: Floats) -> Floats:
    """Second differences that neighbours share: the surface's own."""
    known = np.isfinite(difference).astype(np.float64)
    total, count = (
        uniform_filter(each, _AROUND_PX, mode="constant") for each in (np.nan_to_num(difference), known)
    )
    return np.asarray(total / np.maximum(count, 0.5 / _AROUND_PX**2))


def _median_z(difference: Floats, variance: Floats) -> float:
    return float(np.median(np.abs(difference) / np.sqrt(variance)))
