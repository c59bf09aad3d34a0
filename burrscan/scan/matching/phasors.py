"""Phasors of stripes: what a pixel's frames say of each frequency, and how surely."""

from __future__ import annotations

import numpy as np
from numba import njit

from burrscan.arrays import Complexes, Floats, Image


@njit(cache=True, nogil=True)
def turns_of(steps: int) -> Floats:
    """Cosines and sines (2, steps) of the steps."""
    angles = 2.0 * np.pi * np.arange(steps) / steps
    return np.stack((np.cos(angles), np.sin(angles)))


@njit(cache=True, nogil=True)
def phasors(
    images: Image, r: int, c: int, sheet: Floats, turns: Floats, z: Complexes, variance: Floats
) -> tuple[float, int]:
    """Complex amplitude of each frequency and its variance per component; clipped ones weigh nothing."""
    black, gain, floor, saturation = sheet
    steps = images.shape[0] // len(z)
    usable, total = 0, 0.0
    for j in range(len(z)):
        a, b, light = 0.0, 0.0, 0.0
        whole = True
        for n in range(steps):
            value = float(images[j * steps + n, r, c])
            whole &= value < saturation
            a += value * turns[0, n]
            b += value * turns[1, n]
            light += value - black
        z[j] = complex(a, b) * (2.0 / steps)
        variance[j] = (gain * max(light / steps, 0.0) + floor) * (2.0 / steps)
        if whole:
            usable += 1
            total += light / steps
        else:
            variance[j] = np.inf
    return total / max(usable, 1), usable
