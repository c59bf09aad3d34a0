"""What stands around each camera pixel: sums over its 5 × 5 neighbourhood."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from burrscan.arrays import Bools, Floats

WINDOW = 5
"""Side of the neighbourhood that a pixel's need and its error are read off."""


def summed(values: Floats, where: Bools, *, itself: bool = True) -> Floats:
    """Sum (h, w) of the values that count around each pixel, with or without the pixel itself. O(pixels).

    Only pixels about those that count are looked at. Sums of values that are not negative are not negative.
    """
    sums = np.zeros(where.shape)
    rows, columns = (_reached(np.asarray(where.any(axis=axis))) for axis in (1, 0))
    counted = np.where(where[rows, columns], values[rows, columns], 0.0)
    total = counted
    for axis in (0, 1):
        total = ndimage.correlate1d(total, np.ones(WINDOW), axis=axis, mode="constant")
    sums[rows, columns] = total if itself else np.maximum(total - counted, 0.0)
    return sums


def _reached(some: Bools) -> slice:
    """From the first to the last that counts, and what its neighbourhood reaches."""
    found = np.flatnonzero(some)
    if not found.size:
        return slice(0)
    return slice(max(int(found[0]) - WINDOW // 2, 0), int(found[-1]) + WINDOW // 2 + 1)
