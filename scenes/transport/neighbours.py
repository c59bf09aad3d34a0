"""What stands around each camera pixel: sums over its 5 × 5 neighbourhood."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from burrscan.arrays import Bools, Floats

WINDOW = 5
"""Side of the neighbourhood that a pixel's need and its error are read off."""


def summed(values: Floats, where: Bools, *, itself: bool = True) -> Floats:
    """Sum (h, w) of the values that count around each pixel, with or without the pixel itself. O(pixels).

    Sums of values that are not negative are not negative.
    """
    counted = np.where(where, values, 0.0)
    ones = np.ones(WINDOW)
    total = ndimage.correlate1d(counted, ones, axis=0, mode="constant")
    total = ndimage.correlate1d(total, ones, axis=1, mode="constant")
    return np.asarray(total if itself else np.maximum(total - counted, 0.0))
