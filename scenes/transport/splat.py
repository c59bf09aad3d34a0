"""Turning traced samples into a sparse matrix: one row per camera pixel, one column per projector pixel.

Compiled because a capture at 1280×1024 with 16 samples per pixel has 21 million samples with four taps each;
everything here is linear in the number of samples, and the result does not depend on the number of threads.
"""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from burrscan.arrays import Floats, Floats32, Ints, Ints32
from scenes.transport.profile import PixelProfile

_BOX = 12  # widest footprint, in projector pixels, that is merged on a dense grid
_BOX_AREA = _BOX * _BOX
_CHUNK = 4096  # pixels that share one thread's work space


@nb.njit(cache=True, inline="always")
def _coverage(distance: float, fill: float, blur: float) -> float:
    """Light at ``distance`` from a pixel's centre: a box ``fill`` wide averaged over one ``blur`` wide."""
    if blur <= 0.0:
        return 1.0 / fill if -0.5 * fill <= distance < 0.5 * fill else 0.0
    low = max(distance - 0.5 * blur, -0.5 * fill)
    high = min(distance + 0.5 * blur, 0.5 * fill)
    return max(high - low, 0.0) / (blur * fill)


@nb.njit(cache=True, inline="always")
def _first_tap(x: float, reach: float) -> int:
    return math.ceil(x - reach)


@nb.njit(cache=True)
def _bounds(
    u: Floats32, v: Floats32, w: Floats32, first: int, last: int, shape: tuple[int, int], reach: float
) -> tuple[int, int, int, int]:
    """First row, last row, first column and last column that the samples of one pixel touch."""
    i0, i1, j0, j1 = 1 << 30, -1, 1 << 30, -1
    for s in range(first, last):
        if w[s] > 0.0:
            i0 = min(i0, _first_tap(v[s], reach))
            i1 = max(i1, math.floor(v[s] + reach))
            j0 = min(j0, _first_tap(u[s], reach))
            j1 = max(j1, math.floor(u[s] + reach))
    return max(i0, 0), min(i1, shape[0] - 1), max(j0, 0), min(j1, shape[1] - 1)


@nb.njit(cache=True)
def _gather(
    u: Floats32,
    v: Floats32,
    w: Floats32,
    first: int,
    last: int,
    shape: tuple[int, int],
    fill: float,
    blur: float,
    box: Floats,
    columns: Ints32,
    values: Floats,
) -> int:
    """Merge the samples ``first .. last`` of one pixel into columns and values; return how many."""
    reach = 0.5 * (fill + blur)
    i0, i1, j0, j1 = _bounds(u, v, w, first, last, shape, reach)
    rows, cols = i1 - i0 + 1, j1 - j0 + 1
    if rows <= 0 or cols <= 0:
        return 0
    if rows * cols > box.size:
        scattered: int = _gather_scattered(u, v, w, first, last, shape, fill, blur, columns, values)
        return scattered
    box[: rows * cols] = 0.0
    for s in range(first, last):
        if w[s] > 0.0:
            _add_sample(u[s], v[s], w[s], (i0, i1, j0, j1), fill, blur, box)
    count = 0
    for k in range(rows * cols):
        if box[k] > 0.0:
            columns[count] = (i0 + k // cols) * shape[1] + j0 + k % cols
            values[count] = box[k]
            count += 1
    return count


@nb.njit(cache=True)
def _add_sample(
    u: float, v: float, w: float, bounds: tuple[int, int, int, int], fill: float, blur: float, box: Floats
) -> None:
    """Add one sample's taps to a dense box of rows and columns."""
    i0, i1, j0, j1 = bounds
    reach, cols = 0.5 * (fill + blur), j1 - j0 + 1
    for i in range(max(_first_tap(v, reach), i0), min(math.floor(v + reach), i1) + 1):
        cy = w * _coverage(v - i, fill, blur)
        for j in range(max(_first_tap(u, reach), j0), min(math.floor(u + reach), j1) + 1):
            box[(i - i0) * cols + j - j0] += cy * _coverage(u - j, fill, blur)


@nb.njit(cache=True)
def _insert(column: int, value: float, columns: Ints32, values: Floats, count: int) -> int:
    """Add a value to a short sorted list; return its new length."""
    place = count
    while place > 0 and columns[place - 1] >= column:
        place -= 1
    if place < count and columns[place] == column:
        values[place] += value
        return count
    for k in range(count, place, -1):
        columns[k] = columns[k - 1]
        values[k] = values[k - 1]
    columns[place] = column
    values[place] = value
    return count + 1


@nb.njit(cache=True)
def _gather_scattered(
    u: Floats32,
    v: Floats32,
    w: Floats32,
    first: int,
    last: int,
    shape: tuple[int, int],
    fill: float,
    blur: float,
    columns: Ints32,
    values: Floats,
) -> int:
    """Like ``_gather`` for samples far apart: a footprint torn by a depth edge."""
    count = 0
    for s in range(first, last):
        if w[s] > 0.0:
            count = _insert_sample(u[s], v[s], w[s], shape, fill, blur, columns, values, count)
    return count


@nb.njit(cache=True)
def _insert_sample(
    u: float,
    v: float,
    w: float,
    shape: tuple[int, int],
    fill: float,
    blur: float,
    columns: Ints32,
    values: Floats,
    count: int,
) -> int:
    """Add one sample's taps to a sorted list; return its new length."""
    height, width = shape
    reach = 0.5 * (fill + blur)
    for i in range(max(_first_tap(v, reach), 0), min(math.floor(v + reach), height - 1) + 1):
        cy = w * _coverage(v - i, fill, blur)
        for j in range(max(_first_tap(u, reach), 0), min(math.floor(u + reach), width - 1) + 1):
            value = cy * _coverage(u - j, fill, blur)
            if value > 0.0:
                count = _insert(i * width + j, value, columns, values, count)
    return count


@nb.njit(cache=True, parallel=True)
def _count(
    u: Floats32,
    v: Floats32,
    w: Floats32,
    offsets: Ints,
    shape: tuple[int, int],
    fill: float,
    blur: float,
    chunk: int,
) -> Ints:
    """Entries of each pixel's row."""
    pixels = offsets.size - 1
    counts = np.zeros(pixels, np.int64)
    for c in nb.prange((pixels + chunk - 1) // chunk):
        first, last = c * chunk, min((c + 1) * chunk, pixels)
        room = _room(offsets, first, last)
        box, columns, values = np.empty(_BOX_AREA), np.empty(room, np.int32), np.empty(room)
        for p in range(first, last):
            counts[p] = _gather(u, v, w, offsets[p], offsets[p + 1], shape, fill, blur, box, columns, values)
    return counts


@nb.njit(cache=True, parallel=True)
def _fill(
    u: Floats32,
    v: Floats32,
    w: Floats32,
    offsets: Ints,
    shape: tuple[int, int],
    fill: float,
    blur: float,
    chunk: int,
    starts: Ints,
) -> tuple[Ints32, Floats32]:
    """The entries themselves, at their places in the matrix."""
    pixels = offsets.size - 1
    all_columns = np.empty(starts[-1], np.int32)
    all_values = np.empty(starts[-1], np.float32)
    for c in nb.prange((pixels + chunk - 1) // chunk):
        first, last = c * chunk, min((c + 1) * chunk, pixels)
        room = _room(offsets, first, last)
        box, columns, values = np.empty(_BOX_AREA), np.empty(room, np.int32), np.empty(room)
        for p in range(first, last):
            n = _gather(u, v, w, offsets[p], offsets[p + 1], shape, fill, blur, box, columns, values)
            for k in range(n):
                all_columns[starts[p] + k] = columns[k]
                all_values[starts[p] + k] = values[k]
    return all_columns, all_values


@nb.njit(cache=True)
def _room(offsets: Ints, first: int, last: int) -> int:
    """Entries that one pixel of a chunk can have at most: nine taps a sample, or a dense box."""
    most = 0
    for p in range(first, last):
        most = max(most, offsets[p + 1] - offsets[p])
    return max(9 * most, _BOX_AREA)


def splat(
    u_px: Floats32,
    v_px: Floats32,
    weight: Floats32,
    offsets: Ints,
    *,
    shape: tuple[int, int],
    profile: PixelProfile,
) -> tuple[Ints, Ints32, Floats32]:
    """Merge samples into the rows of a sparse matrix (CSR).

    Parameters
    ----------
    u_px, v_px
        (S,) projector column and row that each sample saw.
    weight
        (S,) light that the sample carries for a white projector; samples of weight 0 are skipped.
    offsets
        (pixels + 1,) samples of camera pixel p are ``offsets[p] .. offsets[p + 1]``.
    shape
        Rows and columns of the projector.
    profile
        Light profile of a projector pixel; light beyond the raster's border is dropped.

    Returns
    -------
    starts, columns, values
        (pixels + 1,) first entry of each row; (nnz,) flat projector pixel; (nnz,) light.

    """
    arguments = (u_px, v_px, weight, offsets, shape, float(profile.fill), float(profile.blur_px), _CHUNK)
    starts = np.zeros(offsets.size, np.int64)
    np.cumsum(_count(*arguments), out=starts[1:])
    columns, values = _fill(*arguments, starts)
    return starts, columns, values


@nb.njit(cache=True, parallel=True)
def _centres(u: Floats32, v: Floats32, w: Floats32, offsets: Ints) -> Floats32:
    pixels = offsets.size - 1
    centres = np.full((3, pixels), np.nan, np.float32)
    for p in nb.prange(pixels):
        total, su, sv, suu = 0.0, 0.0, 0.0, 0.0
        for s in range(offsets[p], offsets[p + 1]):
            if w[s] > 0.0:
                total += w[s]
                su += w[s] * u[s]
                sv += w[s] * v[s]
        if total > 0.0:
            mean = su / total
            for s in range(offsets[p], offsets[p + 1]):
                suu += w[s] * (u[s] - mean) ** 2 if w[s] > 0.0 else 0.0
            centres[0, p] = mean
            centres[1, p] = sv / total
            centres[2, p] = math.sqrt(suu / total)
    return centres


def response_centres(u_px: Floats32, v_px: Floats32, weight: Floats32, offsets: Ints) -> Floats32:
    """Per camera pixel the light-weighted mean u, mean v and standard deviation of u, (3, pixels)."""
    centres: Floats32 = _centres(u_px, v_px, weight, offsets)
    return centres
