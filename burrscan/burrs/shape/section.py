"""Cross-sections of a ridge: triangle, parabola, and the triangle as a pixel's footprint rounds it.

A pixel sees the mean over its footprint, as wide as the distance to the next. So what a scanner gives of a
crest is the triangle's running mean, lower by height · footprint / (2 · base width).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from burrscan.arrays import Floats


@njit(cache=True, nogil=True, error_model="numpy")
def section(
    x: float, left: float, right: float, power: int, footprint: float
) -> tuple[float, float, float, float]:
    """Height of a unit cross-section, and its derivatives with x, the left and the right half-width.

    Parameters
    ----------
    x
        Place across, from the crest, mm.
    left, right
        Half-widths of the base, mm.
    power
        1 for the triangle, 2 for the parabola.
    footprint
        Over what width the triangle is averaged, mm; the parabola is not.

    """
    if x <= -left - 0.5 * footprint or x >= right + 0.5 * footprint:
        return 0.0, 0.0, 0.0, 0.0
    if footprint == 0.0 or power == 2:
        half = right if x >= 0.0 else left
        q = abs(x) / half
        slope = power * (q if power == 2 else 1.0)
        by_half = slope * q / half
        height, by_x = 1.0 - q**power, -slope / half * (1.0 if x >= 0.0 else -1.0)
        return height, by_x, (by_half if x < 0.0 else 0.0), (by_half if x >= 0.0 else 0.0)
    a, a_left, a_right, a_x = _below(x - 0.5 * footprint, left, right)
    b, b_left, b_right, b_x = _below(x + 0.5 * footprint, left, right)
    each = 1.0 / footprint
    return (b - a) * each, (b_x - a_x) * each, (b_left - a_left) * each, (b_right - a_right) * each


@njit(cache=True, nogil=True, error_model="numpy")
def _below(x: float, left: float, right: float) -> tuple[float, float, float, float]:
    """Area of a unit triangle up to x, its derivatives with both half-widths, and the triangle's height."""
    if x < 0.0:
        t = max(1.0 + x / left, 0.0)
        return 0.5 * left * t * t, 0.5 * t * t - t * min(x / left, 0.0), 0.0, t
    s = max(1.0 - x / right, 0.0)
    return 0.5 * left + 0.5 * right * (1.0 - s * s), 0.5, 0.5 * (1.0 - s * s) - s * x / right, s


@njit(cache=True, nogil=True, error_model="numpy")
def sections(x: Floats, left: float, right: float, power: int, footprint: float) -> Floats:
    """(N,) heights of a unit cross-section."""
    height = np.empty(len(x))
    for i in range(len(x)):
        height[i] = section(x[i], left, right, power, footprint)[0]
    return height
