"""Heterodyne phase shifting: three close periods, unwrapped by their beats and then fused.

The difference of two phases is a phase of their beat's longer period, which tells the stripe of the finer
one (Reich, Ritter, Thesing 1997).
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numba import njit, prange

from burrscan.arrays import Bools, Floats32, Image
from burrscan.codes.code import Code
from burrscan.codes.phase import harmonics, phase_row, sheet_of
from burrscan.codes.rivals.multifrequency import MARGIN, encode, longest_px
from burrscan.correspondence import Correspondence
from burrscan.devices import CameraSheet


def beats_px(*, width: int, finest_px: float) -> tuple[float, float, float]:
    """Three close periods whose beats' beat is a little longer than the projector is wide.

    The beats of neighbours are the geometric mean of the finest period and the width.
    """
    width_px = longest_px(width=width)
    beat = 1.0 / float(np.sqrt(finest_px * width_px))
    first = 1.0 / finest_px
    second = first - beat
    third = second - (beat - 1.0 / width_px)
    return 1.0 / first, 1.0 / second, 1.0 / third


def heterodyne(*, width: int, finest_px: float = 16.0, steps: int = 8, max_sigma_px: float = 0.4) -> Code:
    """Three close periods, unwrapped by their beats."""
    periods = beats_px(width=width, finest_px=finest_px)
    light, names = encode(width=width, periods_px=periods, steps=steps)
    read = partial(decode_beats, width=width, periods_px=periods, steps=steps, max_sigma_px=max_sigma_px)
    return Code(light, names, read)


def decode_beats(
    images: Image,
    camera: CameraSheet,
    *,
    width: int,
    periods_px: tuple[float, float, float],
    steps: int,
    max_sigma_px: float,
    z: float = 4.0,
) -> Correspondence:
    """Beat of beats, then beat, then the finest period; the columns of all three are then fused.

    Parameters
    ----------
    images
        (3 · steps, h, w) DN, in the order of :func:`burrscan.codes.rivals.multifrequency.encode`.
    camera
        The noise model.
    width, periods_px, steps
        The code; periods rise.
    max_sigma_px
        Coarser pixels are masked.
    z
        A pixel is masked where so many sigmas of a beat could name another stripe of the next finer one, or
        where the two differ by more than that and one column.

    Notes
    -----
    The three periods are nearly equal, so each carries nearly as much information as the finest. The phases'
    noise is independent: the mean weighted by inverse variances has the inverse of the summed weights as its
    variance. O(frames · pixels), each frame read once.

    """
    first, second, third = (1.0 / period for period in periods_px)
    near, far = first - second, second - third
    rule = np.array([first, second, third, near, near - far, z, width, max_sigma_px], np.float32)
    waves, sheet = harmonics(steps), sheet_of(camera).astype(np.float32)
    return Correspondence(*_beats(np.ascontiguousarray(images), waves, sheet, rule))


@njit(cache=True, parallel=True, nogil=True)
def _beats(
    images: Image, waves: Floats32, sheet: Floats32, rule: Floats32
) -> tuple[Floats32, Floats32, Bools]:
    _, height, width = images.shape
    steps = waves.shape[1]
    u_px = np.empty((height, width), np.float32)
    sigma_px = np.empty((height, width), np.float32)
    mask = np.empty((height, width), np.bool_)
    for r in prange(height):
        sums, room = np.empty((6, width), np.float32), np.empty((5, width), np.float32)
        planes, clipped = np.empty((3, 4, width), np.float32), np.empty((3, width), np.bool_)
        for k in range(3):
            block = images[k * steps : (k + 1) * steps]
            phase_row(block, np.int64(r), waves, sheet, sums, planes[k], clipped[k])
        _unwrap(planes[:, 0], rule, room[:3])
        room[3:] = np.float32(0.0)
        for k in range(3):
            _weigh(planes[k, 0], planes[k, 1], room[0], rule[k], room[3], room[4])
        _mean(room[0], room[3], room[4], u_px[r], sigma_px[r])
        _accept(planes[:, 1], room[1], room[2], clipped, rule, u_px[r], sigma_px[r], mask[r])
    return u_px, sigma_px, mask


@njit(cache=True, nogil=True)
def _unwrap(turns: Floats32, rule: Floats32, out: Floats32) -> None:
    """Columns by the finest period (row 0 of ``out``), and how far each of the two steps there was, px."""
    first, near, longest = rule[0], rule[3], rule[4]
    margin = np.float32(0.5 * MARGIN / (1.0 + MARGIN))
    t0, t1, t2, u, one, two = turns[0], turns[1], turns[2], out[0], out[1], out[2]
    for c in range(len(u)):
        beat = t0[c] - t1[c]
        turn = beat - (t1[c] - t2[c]) + margin
        column = (turn - np.floor(turn) - margin) / longest
        step = _signed(beat - column * near) / near
        column += step
        one[c] = abs(step)
        step = _signed(t0[c] - column * first) / first
        two[c] = abs(step)
        u[c] = column + step


@njit(cache=True, nogil=True, inline="always")
def _signed(turns: np.float32) -> np.float32:
    """Turns within half a turn of 0."""
    turned: np.float32 = turns - np.floor(turns + np.float32(0.5))
    return turned


@njit(cache=True, nogil=True, error_model="numpy")
def _weigh(
    turns: Floats32, sigma: Floats32, u: Floats32, per_px: np.float32, moment: Floats32, weight: Floats32
) -> None:
    """Add one phase's inverse variance, and its distance from column ``u`` weighted by it."""
    for c in range(len(u)):
        information = per_px * per_px / (sigma[c] * sigma[c])
        moment[c] += information * _signed(turns[c] - u[c] * per_px) / per_px
        weight[c] += information


@njit(cache=True, nogil=True, error_model="numpy")
def _mean(start: Floats32, moment: Floats32, weight: Floats32, u: Floats32, sigma: Floats32) -> None:
    for c in range(len(u)):
        u[c] = start[c] + moment[c] / weight[c]
        sigma[c] = np.float32(1.0) / np.sqrt(weight[c])


@njit(cache=True, nogil=True)
def _accept(
    sigma: Floats32,
    one: Floats32,
    two: Floats32,
    clipped: Bools,
    rule: Floats32,
    u: Floats32,
    sigma_px: Floats32,
    mask: Bools,
) -> None:
    """Mask what is clipped, coarse, outside, or where noise could name another stripe."""
    first, near, longest, z, width, most = rule[0], rule[3], rule[4], rule[5], rule[6], rule[7]
    for c in range(len(u)):
        v0, v1, v2 = sigma[0, c] ** 2, sigma[1, c] ** 2, sigma[2, c] ** 2
        coarse, fine = z * np.sqrt(v0 + np.float32(4.0) * v1 + v2) / longest, z * np.sqrt(v0 + v1) / near
        sure = (2.0 * coarse * near <= 1.0) & (2.0 * fine * first <= 1.0)
        sure &= (one[c] <= coarse + 1.0) & (two[c] <= fine + 1.0)
        inside = (u[c] > -0.5) & (u[c] < width - 0.5) & (sigma_px[c] <= most)
        mask[c] = sure & inside & ~(clipped[0, c] | clipped[1, c] | clipped[2, c])
        if not mask[c]:
            u[c], sigma_px[c] = np.nan, np.nan
