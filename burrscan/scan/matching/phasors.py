"""Phasors of stripes: what a pixel's frames say of each frequency, and how surely.

For the inner loops cosine and sine come without a branch, so that they run in a processor's vectors.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.polynomial import Chebyshev, Polynomial

from burrscan.arrays import Complexes, Floats, Floats32, Image
from burrscan.codes.phase import add_light, add_wave
from burrscan.devices import CameraSheet

_DEGREE = 9
"""In x²: the ten coefficients that leave an error below 1e-11."""


def _series(*, odd: bool) -> tuple[float, ...]:
    """Series of cos 2πx, or sin 2πx / x, on -½ .. ½ as a polynomial in x², by Chebyshev interpolation."""

    def wave(squares: Floats) -> Floats:
        x = np.sqrt(squares)
        return np.asarray(np.sin(2.0 * np.pi * x) / x if odd else np.cos(2.0 * np.pi * x))

    found = Chebyshev.interpolate(wave, _DEGREE, domain=[0.0, 0.25])
    return tuple(float(a) for a in found.convert(kind=Polynomial).coef)


_C0, _C1, _C2, _C3, _C4, _C5, _C6, _C7, _C8, _C9 = _series(odd=False)
_S0, _S1, _S2, _S3, _S4, _S5, _S6, _S7, _S8, _S9 = _series(odd=True)
_TURNS_PER_RADIAN = 0.5 / np.pi
"""1 / 2π."""


@njit(cache=True, nogil=True, inline="always")
def cosine_sine(angle: float) -> tuple[float, float]:
    """Cosine and sine of an angle in radians, off by less than 1e-11 up to a thousand turns."""
    turns = angle * _TURNS_PER_RADIAN
    x = turns - np.floor(turns + 0.5)
    s = x * x
    c = _C4 + s * (_C5 + s * (_C6 + s * (_C7 + s * (_C8 + s * _C9))))
    c = _C0 + s * (_C1 + s * (_C2 + s * (_C3 + s * c)))
    d = _S4 + s * (_S5 + s * (_S6 + s * (_S7 + s * (_S8 + s * _S9))))
    d = _S0 + s * (_S1 + s * (_S2 + s * (_S3 + s * d)))
    return c, x * d


def sheet_of(camera: CameraSheet) -> Floats:
    """What kernels need of a data sheet: black level, gain, variance in the dark, saturation, in DN."""
    floor = (camera.gain_dn_per_e * camera.read_noise_e) ** 2 + 1.0 / 12.0
    return np.array([camera.black_level_dn, camera.gain_dn_per_e, floor, camera.clipped_dn])


@njit(cache=True, nogil=True)
def turns_of(steps: int) -> Floats:
    """Cosines and sines (2, steps) of the steps."""
    angles = 2.0 * np.pi * np.arange(steps) / steps
    return np.stack((np.cos(angles), np.sin(angles)))


@njit(cache=True, nogil=True)
def row_sums(images: Image, r: int, turns: Floats) -> Floats32:
    """A row's sums (4, K, w) over each frequency's steps: by cosine, by sine, plain, and the highest value.

    Each frame is read once, in order.
    """
    steps = turns.shape[1]
    count = images.shape[0] // steps
    sums = np.zeros((4, count, images.shape[2]), np.float32)
    for j in range(count):
        for n in range(steps):
            row = images[j * steps + n, r]
            add_wave(row, np.float32(turns[0, n]), np.float32(turns[1, n]), sums[0, j], sums[1, j])
            add_light(row, sums[2, j], sums[3, j])
    return sums


@njit(cache=True, nogil=True)
def phasors_of(
    sums: Floats32, c: int, sheet: Floats, steps: int, z: Complexes, variance: Floats
) -> tuple[float, int]:
    """:func:`phasors` of a pixel from its row's sums."""
    black, gain, floor, saturation = sheet
    usable, total = 0, 0.0
    for j in range(len(z)):
        z[j] = complex(sums[0, j, c], sums[1, j, c]) * (2.0 / steps)
        light = sums[2, j, c] / steps - black
        variance[j] = (gain * max(light, 0.0) + floor) * (2.0 / steps)
        if sums[3, j, c] < saturation:
            usable += 1
            total += light
        else:
            variance[j] = np.inf
    return total / max(usable, 1), usable


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
