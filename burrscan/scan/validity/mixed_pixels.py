"""Mixed pixels: footprints cut by a depth edge, which hold light of their neighbour's column as well.

Beside a jump the phasors are explained by two columns at once, the pixel's own and the one across the jump.
Where the second carries enough light to move the footprint's centre, the pixel has no one column.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from burrscan.arrays import Bools, Complexes, Floats, Floats32, Image
from burrscan.codes.phase import sheet_of
from burrscan.devices import CameraSheet
from burrscan.scan.matching.matched import Reading
from burrscan.scan.matching.phasors import phasors, turns_of
from burrscan.scan.stripes import Stripes


def mixed_pixels(
    reading: Reading,
    images: Image,
    code: Stripes,
    *,
    camera: CameraSheet,
    jump_px: float = 2.5,
    most_moved_px: float = 0.4,
) -> Bools:
    """Pixels (h, w) whose centre another column across a jump moves.

    Parameters
    ----------
    reading, images, code, camera
        A round and what it was read from.
    jump_px
        Neighbours further apart than this (twice that at two pixels' distance) have an edge between them.
    most_moved_px
        The second column's share of the light times the jump may be no more than this, unless the share is
        within three sigmas of nothing.

    Notes
    -----
    O(pixels + pixels beside edges · K).

    """
    found: Bools = _mixed(
        images,
        2.0 * np.pi * code.per_column,
        2.0 * np.pi * code.per_row,
        reading.u_px,
        reading.v_px,
        sheet_of(camera),
        jump_px,
        most_moved_px,
    )
    return found


@njit(cache=True, nogil=True)
def _across(u: Floats32, r: int, c: int, step: int, jump: float) -> tuple[int, int, float]:
    """The neighbour of a number, and how far its column is away; 0 where no edge lies between."""
    far = 1 + step // 4
    y = r + (far if step % 4 == 0 else (-far if step % 4 == 1 else 0))
    x = c + (far if step % 4 == 2 else (-far if step % 4 == 3 else 0))
    if not (0 <= y < u.shape[0] and 0 <= x < u.shape[1]):
        return r, c, 0.0
    apart = abs(u[y, x] - u[r, c])
    return y, x, apart if apart > far * jump else 0.0


@njit(cache=True, nogil=True)
def _beside_jump(u: Floats32, r: int, c: int, jump: float) -> bool:
    """Whether any neighbour lies across an edge."""
    beside = False
    for step in range(8):
        beside |= _across(u, r, c, step, jump)[2] > 0.0
    return beside


@njit(cache=True, nogil=True)
def _is_moved(
    z: Complexes,
    variance: Floats,
    f: Floats,
    g: Floats,
    u: Floats32,
    v: Floats32,
    r: int,
    c: int,
    jump: float,
    most: float,
) -> bool:
    """Whether the column of any neighbour across an edge moves a pixel's centre."""
    moved = False
    for step in range(8):
        y, x, apart = _across(u, r, c, step, jump)
        if apart > 0.0:
            share, sigma = _second(z, variance, f * u[r, c] + g * v[r, c], f * u[y, x] + g * v[y, x])
            moved |= share * apart > most and share > 3.0 * sigma
    return moved


@njit(cache=True, parallel=True, nogil=True)
def _mixed(
    images: Image,
    f: Floats,
    g: Floats,
    u: Floats32,
    v: Floats32,
    sheet: Floats,
    jump: float,
    most: float,
) -> Bools:
    height, width = u.shape
    found = np.zeros((height, width), np.bool_)
    turns = turns_of(images.shape[0] // len(f))
    for r in prange(height):
        z = np.empty(len(f), np.complex128)
        variance = np.empty(len(f))
        for c in range(width):
            if not np.isfinite(u[r, c]):
                continue
            if not _beside_jump(u, np.int64(r), c, jump):
                continue
            phasors(images, np.int64(r), c, sheet, turns, z, variance)
            found[r, c] = _is_moved(z, variance, f, g, u, v, np.int64(r), c, jump, most)
    return found


@njit(cache=True, nogil=True)
def _second(z: Complexes, variance: Floats, one: Floats, two: Floats) -> tuple[float, float]:
    """Share of a second component's amplitude, and its sigma by noise and what neither explains."""
    a11, a12, b1, b2 = 0.0, 0.0, 0.0, 0.0
    for j in range(len(z)):
        k = 1.0 / variance[j]
        a11 += k
        a12 += k * np.cos(one[j] - two[j])
        b1 += k * (z[j].real * np.cos(one[j]) + z[j].imag * np.sin(one[j]))
        b2 += k * (z[j].real * np.cos(two[j]) + z[j].imag * np.sin(two[j]))
    det = a11 * a11 - a12 * a12
    if not det > 0.0:
        return 0.0, np.inf
    first, second = (a11 * b1 - a12 * b2) / det, (a11 * b2 - a12 * b1) / det
    total = max(first, 0.0) + max(second, 0.0)
    if not total > 0.0:
        return 0.0, np.inf
    chi2, dof = 0.0, -4.0
    for j in range(len(z)):
        real = z[j].real - first * np.cos(one[j]) - second * np.cos(two[j])
        imaginary = z[j].imag - first * np.sin(one[j]) - second * np.sin(two[j])
        chi2 += (real * real + imaginary * imaginary) / variance[j]
        dof += 2.0 if variance[j] < np.inf else 0.0
    return max(second, 0.0) / total, np.sqrt(a11 / det * max(chi2 / dof, 1.0)) / total
