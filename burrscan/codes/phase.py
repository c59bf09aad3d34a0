"""N-step phase shifting of sine stripes.

Srinivasan, Liu, Halioua 1984; noise: sigma_phase = sqrt(2 / N) sigma_I / amplitude (Surrel 1997).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit, prange

from burrscan.arrays import Bools, Floats, Floats32, Image
from burrscan.devices import CameraSheet

# atan(x) / 2π as x times a polynomial in x², by Chebyshev interpolation: off by less than 1e-7 on 0 .. 1
_A0, _A1, _A2, _A3, _A4, _A5, _A6, _A7, _A8 = (
    np.float32(a)
    for a in np.polynomial.Chebyshev.interpolate(
        lambda s: np.arctan(np.sqrt(s)) / np.sqrt(s) / (2.0 * np.pi), 8, domain=[0.0, 1.0]
    )
    .convert(kind=np.polynomial.Polynomial)
    .coef
)


@dataclass(frozen=True)
class Phase:
    """One stripe period's decoded phase, as a position within the period.

    Parameters
    ----------
    offset_px
        (h, w) position within the period, 0 .. period, column 0 at 0.
    sigma_px
        (h, w) its standard deviation by the camera's noise, px; vast or infinite without modulation.
    amplitude_dn, mean_dn
        (h, w) of the sine.
    clipped
        (h, w) True where any step reached saturation.
    period_px
        Columns per period.

    """

    offset_px: Floats32
    sigma_px: Floats32
    amplitude_dn: Floats32
    mean_dn: Floats32
    clipped: Bools
    period_px: float


def encode_phase(*, width: int, period_px: float, steps: int) -> tuple[Floats, tuple[str, ...]]:
    """Light (steps, width) ½ + ½ cos(2π (u / period - n / steps)), and names. O(steps·width)."""
    turns = np.arange(width) / period_px - np.arange(steps)[:, None] / steps
    names = tuple(f"sine-u-{period_px:.4g}px-{n:02d}" for n in range(steps))
    return 0.5 + 0.5 * np.cos(2.0 * np.pi * turns), names


def decode_phase(images: Image, *, camera: CameraSheet, period_px: float) -> Phase:
    """Phase, modulation and stated sigma from N >= 3 equally spaced steps.

    Parameters
    ----------
    images
        (N, h, w) DN, in the order of :func:`encode_phase`.
    camera
        Gives each value's variance, which is propagated through the estimate step by step.
    period_px
        Columns per period.

    Notes
    -----
    O(N) per pixel, one pass over the images, single precision: good to 1e-7 of a period.

    """
    waves, sheet = harmonics(len(images)), sheet_of(camera).astype(np.float32)
    planes, clipped = _phase(np.ascontiguousarray(images), waves, sheet, np.float32(period_px))
    return Phase(planes[0], planes[1], planes[2], planes[3], clipped, period_px)


def harmonics(steps: int) -> Floats32:
    """(4, steps): cosine and sine of the first and of the second harmonic at each step."""
    turn = 2.0 * np.pi * np.arange(steps) / steps
    return np.stack([np.cos(turn), np.sin(turn), np.cos(2.0 * turn), np.sin(2.0 * turn)]).astype(np.float32)


def sheet_of(camera: CameraSheet) -> Floats:
    """What the kernels need of a data sheet, in DN: black level, gain, variance in the dark, saturation."""
    floor = (camera.gain_dn_per_e * camera.read_noise_e) ** 2 + 1.0 / 12.0
    return np.array([camera.black_level_dn, camera.gain_dn_per_e, floor, camera.clipped_dn])


@njit(cache=True, parallel=True, nogil=True)
def _phase(images: Image, waves: Floats32, sheet: Floats32, period: np.float32) -> tuple[Floats32, Bools]:
    _, height, width = images.shape
    planes = np.empty((4, height, width), np.float32)
    clipped = np.empty((height, width), np.bool_)
    for r in prange(height):
        row = np.empty((4, width), np.float32)
        sums = np.empty((6, width), np.float32)
        # the loop's own index is unsigned: the row's kernel would be compiled for both
        phase_row(images, np.int64(r), waves, sheet, sums, row, clipped[r])
        for c in range(width):
            planes[0, r, c], planes[1, r, c] = row[0, c] * period, row[1, c] * period
        planes[2, r], planes[3, r] = row[2], row[3]
    return planes, clipped


# Rows are taken in several short loops over few arrays each: only such loops run in a processor's vectors.


@njit(cache=True, nogil=True)
def phase_row(
    images: Image, r: int, waves: Floats32, sheet: Floats32, sums: Floats32, planes: Floats32, clipped: Bools
) -> None:
    """Turns (0 .. 1), their sigma, amplitude and mean (4, w) of row ``r``, and where it clipped.

    ``images`` (steps, h, w) must be contiguous; ``sums`` (6, w) is room to work in.
    """
    steps = len(images)
    sums[:] = np.float32(0.0)
    for n in range(steps):
        add_wave(images[n, r], waves[0, n], waves[1, n], sums[0], sums[1])
        add_light(images[n, r], sums[2], sums[3])
        # second harmonics of the values: what shot noise, proportional to the light, needs
        add_wave(images[n, r], waves[2, n], waves[3, n], sums[4], sums[5])
    _turns_of(sums[0], sums[1], planes[0])
    _sigma_of(sums[0], sums[1], sums[2], sums[4], sums[5], np.float32(steps), sheet, planes[1])
    _size_of(sums[0], sums[1], np.float32(steps), planes[2])
    for c in range(len(clipped)):
        planes[3, c] = sums[2, c] / np.float32(steps)
        clipped[c] = sums[3, c] >= sheet[3]


@njit(cache=True, nogil=True)
def add_wave(row: Image, cosine: np.float32, sine: np.float32, a: Floats32, b: Floats32) -> None:
    """Add a row of values times a step's cosine and sine."""
    for c in range(len(row)):
        value = np.float32(row[c])
        a[c] += value * cosine
        b[c] += value * sine


@njit(cache=True, nogil=True)
def add_light(row: Image, total: Floats32, peak: Floats32) -> None:
    """Add a row of values, and carry the highest."""
    for c in range(len(row)):
        value = np.float32(row[c])
        total[c] += value
        peak[c] = max(peak[c], value)


@njit(cache=True, nogil=True)
def _turns_of(a: Floats32, b: Floats32, turns: Floats32) -> None:
    for c in range(len(a)):
        turns[c] = _turns(a[c], b[c])


@njit(cache=True, nogil=True, error_model="numpy")
def _size_of(a: Floats32, b: Floats32, steps: np.float32, amplitude: Floats32) -> None:
    for c in range(len(a)):
        amplitude[c] = np.float32(2.0) * np.sqrt(a[c] * a[c] + b[c] * b[c]) / steps


@njit(cache=True, nogil=True, error_model="numpy")
def _sigma_of(
    a: Floats32,
    b: Floats32,
    total: Floats32,
    a2: Floats32,
    b2: Floats32,
    steps: np.float32,
    sheet: Floats32,
    sigma: Floats32,
) -> None:
    """The variance of the component across (a, b), sum of var_n sin²(turn_n - phase), as an angle."""
    black, gain, floor = sheet[0], sheet[1], sheet[2]
    zero, half, per_rad = np.float32(0.0), np.float32(0.5), np.float32(0.5 / np.pi)
    for c in range(len(a)):
        x, y = a[c], b[c]
        square = x * x + y * y
        across = (a2[c] * (x * x - y * y) + np.float32(2.0) * b2[c] * x * y) / max(square, np.float32(1e-20))
        light = max(total[c] - steps * black, zero)
        variance = half * (gain * max(light - across, zero) + floor * steps)
        sigma[c] = per_rad * np.sqrt(variance / square)


@njit(cache=True, nogil=True, inline="always")
def _turns(x: np.float32, y: np.float32) -> np.float32:
    """The angle of (x, y) in turns, 0 .. 1, without a branch so that a processor's vectors can do it."""
    ax, ay = abs(x), abs(y)
    q = min(ax, ay) / max(ax, ay, np.float32(1e-30))
    s = q * q
    p = _A4 + s * (_A5 + s * (_A6 + s * (_A7 + s * _A8)))
    p = q * (_A0 + s * (_A1 + s * (_A2 + s * (_A3 + s * p))))
    p = np.float32(0.25) - p if ay > ax else p
    p = np.float32(0.5) - p if x < np.float32(0.0) else p
    p = np.float32(1.0) - p if y < np.float32(0.0) else p
    turned: np.float32 = p
    return turned
