"""Complementary phase shifting: inverted sines stand in where the regular ones saturate.

Jiang, Deng, Zhang 2016 ("High dynamic range real-time 3D shape measurement", Optics Express 24(7)): every
sine is shown again inverted, and a pixel takes whichever of the two is not clipped. An odd number of steps
makes the inverted ones fall halfway between the regular ones, so that both together are twice as many even
steps; here each pixel is solved by least squares from all of them that it has unclipped, three at least.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from numba import njit, prange

from burrscan.arrays import Bools, Floats, Floats32, Image
from burrscan.codes.code import Code
from burrscan.codes.gray import decode_gray, encode_gray
from burrscan.codes.gray_phase import unwrap
from burrscan.codes.phase import Phase, encode_phase, sheet_of
from burrscan.correspondence import Correspondence
from burrscan.devices import CameraSheet
from burrscan.errors import InputError

_CLEAR_SIGMAS = 3.0
"""Noise deviations by which a step must be predicted below saturation; nearer, clipping would bias the
sine."""
_WORST_CONDITION = 1e-3
"""Determinant of the sine's equations per n³, 1/4 for even steps: below it the steps left do not tell a
sine."""


def complementary(*, width: int, period_px: int = 16, steps: int = 5, max_sigma_px: float = 0.4) -> Code:
    """Gray code with inverses to half the period, then sines, each followed by its inverse.

    Parameters
    ----------
    width
        Columns of the projector.
    period_px
        Columns per period.
    steps
        Regular steps, odd, at least three; with five or more a pixel whose light is three times too much
        still has three unclipped ones.
    max_sigma_px
        Coarser pixels are masked.

    Raises
    ------
    burrscan.errors.InputError
        When ``steps`` is even, for then the inverses repeat the regular steps and tell nothing more.

    """
    if steps < 3 or steps % 2 == 0:
        raise InputError(f"complementary phase needs an odd number of steps, 3 or more, not {steps}")
    bits, bit_names = encode_gray(width=width, cell_px=period_px // 2)
    sines, sine_names = encode_phase(width=width, period_px=float(period_px), steps=steps)
    both = np.stack([sines, 1.0 - sines], axis=1).reshape(2 * steps, width)
    names = tuple(name for sine in sine_names for name in (sine, f"{sine}-inverse"))
    read = partial(decode, width=width, period_px=period_px, max_sigma_px=max_sigma_px)
    return Code(np.concatenate([bits, both]), bit_names + names, read)


def decode(
    images: Image, camera: CameraSheet, *, width: int, period_px: int, max_sigma_px: float
) -> Correspondence:
    """Columns from Gray cells and the phase of the unclipped steps.

    A pixel is accepted when three steps are clear of clipping and settle the phase, its sigma is at most
    ``max_sigma_px``, at most one Gray bit is doubtful and flipping it changes nothing, and cell and phase
    agree to within a quarter period.
    """
    bits = len(encode_gray(width=width, cell_px=period_px // 2)[1])
    phase = decode_unclipped(images[bits:], camera=camera, period_px=float(period_px))
    cell, other = decode_gray(images[:bits], camera=camera)
    u_px, agrees = unwrap(phase, cell, cell_px=period_px // 2)
    u_other, _ = unwrap(phase, other, cell_px=period_px // 2)
    mask = agrees & (other >= 0) & (u_px == u_other) & (phase.sigma_px <= max_sigma_px) & ~phase.clipped
    mask &= (u_px > -0.5) & (u_px < width - 0.5)
    nan = np.float32(np.nan)
    return Correspondence(
        np.where(mask, u_px, nan).astype(np.float32), np.where(mask, phase.sigma_px, nan), mask
    )


def decode_unclipped(images: Image, *, camera: CameraSheet, period_px: float) -> Phase:
    """Phase by least squares from the steps that are clear of clipping.

    Parameters
    ----------
    images
        (2 steps, h, w) DN: each regular step followed by its inverse.
    camera
        The noise model, and where clipping begins.
    period_px
        Columns per period.

    Returns
    -------
    Phase
        ``clipped`` marks the pixels that no three clear steps settle.

    Notes
    -----
    Which steps are clear is decided by the sine that a first fit to the values below saturation predicts,
    with three sigmas to spare, not by the values themselves: picking values by their own noise would bend
    the fit. Sigma follows from the normal matrix and each value's variance. O(steps) per pixel.

    """
    steps = len(images) // 2
    turns = np.arange(steps) / steps
    angle = 2.0 * np.pi * np.stack([turns, turns + 0.5], axis=1).ravel()
    waves = np.stack([np.cos(angle), np.sin(angle)])
    planes, clipped = _solve(np.ascontiguousarray(images), waves, sheet_of(camera).astype(np.float32))
    offset = np.float32(period_px) * planes[0]
    return Phase(offset, np.float32(period_px) * planes[1], planes[2], planes[3], clipped, period_px)


@njit(cache=True, parallel=True, nogil=True)
def _solve(images: Image, waves: Floats, sheet: Floats32) -> tuple[Floats32, Bools]:
    steps, height, width = images.shape
    planes = np.empty((4, height, width), np.float32)
    clipped = np.empty((height, width), np.bool_)
    for r in prange(height):
        use, clear, inverse = np.empty(steps, np.bool_), np.empty(steps, np.bool_), np.empty(6)
        for c in range(width):
            values = images[:, r, c]
            for n in range(steps):
                use[n] = values[n] < sheet[3]
            sine = _fit(values, waves, use, inverse)
            if _keep_clear(sine, waves, sheet, use, clear):
                sine = _fit(values, waves, clear, inverse)
            size = math.hypot(sine[1], sine[2])
            clipped[r, c] = not size > 0.0
            planes[0, r, c] = math.atan2(sine[2], sine[1]) / (2.0 * math.pi) % 1.0
            planes[1, r, c] = _sigma_turns(sine, waves, sheet, clear, inverse)
            planes[2, r, c], planes[3, r, c] = size, sine[0]
    return planes, clipped


@njit(cache=True, nogil=True)
def _fit(values: Image, waves: Floats, use: Bools, inverse: Floats) -> tuple[float, float, float]:
    """Mean, cosine and sine amplitude of the used values; NaN where they do not settle them.

    ``inverse`` is filled with the inverse normal matrix of (1, cos, sin): its entries 00, 01, 02, 11, 12, 22.
    """
    n, x, y, xx, xy, yy, s, sx, sy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(len(use)):
        if use[i]:
            a, b, value = waves[0, i], waves[1, i], float(values[i])
            n, x, y, xx, xy, yy = n + 1.0, x + a, y + b, xx + a * a, xy + a * b, yy + b * b
            s, sx, sy = s + value, sx + value * a, sy + value * b
    p, q, t = xx * yy - xy * xy, xy * y - x * yy, x * xy - xx * y
    determinant = n * p + x * q + y * t
    if determinant <= _WORST_CONDITION * n * n * n:
        return math.nan, math.nan, math.nan
    inverse[0], inverse[1], inverse[2] = p / determinant, q / determinant, t / determinant
    inverse[3], inverse[4] = (n * yy - y * y) / determinant, (x * y - n * xy) / determinant
    inverse[5] = (n * xx - x * x) / determinant
    return (
        inverse[0] * s + inverse[1] * sx + inverse[2] * sy,
        inverse[1] * s + inverse[3] * sx + inverse[4] * sy,
        inverse[2] * s + inverse[4] * sx + inverse[5] * sy,
    )


@njit(cache=True, nogil=True, inline="always")
def _mean(sine: tuple[float, float, float], a: float, b: float) -> float:
    """The value that the sine predicts, DN."""
    return sine[0] + sine[1] * a + sine[2] * b


@njit(cache=True, nogil=True, inline="always")
def _variance(mean: float, sheet: Floats32) -> float:
    """Variance, DN², of a value of that mean."""
    return float(sheet[1] * max(mean - sheet[0], 0.0) + sheet[2])


@njit(cache=True, nogil=True)
def _keep_clear(
    sine: tuple[float, float, float], waves: Floats, sheet: Floats32, use: Bools, clear: Bools
) -> bool:
    """Which steps the sine predicts clear of saturation; whether they are others than those in use."""
    changed = False
    for i in range(len(use)):
        mean = _mean(sine, waves[0, i], waves[1, i])
        clear[i] = mean + _CLEAR_SIGMAS * math.sqrt(_variance(mean, sheet)) < sheet[3]
        changed |= clear[i] != use[i]
    return changed


@njit(cache=True, nogil=True)
def _sigma_turns(
    sine: tuple[float, float, float], waves: Floats, sheet: Floats32, use: Bools, inverse: Floats
) -> float:
    """Standard deviation of the phase, turns: each value's pull on it, times the value's own deviation."""
    square = sine[1] ** 2 + sine[2] ** 2
    if not square > 0.0:
        return math.inf
    g, h = -sine[2] / square, sine[1] / square
    of_mean, of_cos = g * inverse[1] + h * inverse[2], g * inverse[3] + h * inverse[4]
    of_sin = g * inverse[4] + h * inverse[5]
    variance = 0.0
    for i in range(len(use)):
        if use[i]:
            pull = of_mean + of_cos * waves[0, i] + of_sin * waves[1, i]
            variance += pull * pull * _variance(_mean(sine, waves[0, i], waves[1, i]), sheet)
    return math.sqrt(variance) / (2.0 * math.pi)
