"""What stands around each camera pixel: sums over its 5 × 5 neighbourhood."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from burrscan.arrays import Bools, Floats

WINDOW = 5
"""Side of the neighbourhood that a pixel's need and its error are read off."""


def summed(values: Floats, where: Bools, *, itself: bool = True) -> Floats:
    """Sum (h, w) of the values that count around each pixel, with or without the pixel itself. O(pixels)."""
    kernel = np.ones((WINDOW, WINDOW))
    kernel[WINDOW // 2, WINDOW // 2] = float(itself)
    return np.asarray(ndimage.convolve(np.where(where, values, 0.0), kernel, mode="constant"))
