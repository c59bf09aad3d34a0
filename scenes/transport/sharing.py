"""Sharing interreflected light among neighbours: a few random paths stand for an integral.

Real interreflected light is smooth over neighbouring camera pixels. Sixteen random paths per pixel are not:
one that carries much (a dark pixel that happens to see a highlight) makes the pixel glow alone, and a handful
of paths follows patterns so fine that the integral would wash them out. So every interreflected sample is
shared, in equal parts, among the lit pixels of the 2×2 tile around it, and one that is too bright among those
of the smallest tile, up to 16×16, that brings its share below 5 % of the pixel's direct light. No light is
lost, and the mean over aligned tiles of 16×16 pixels is kept: the test against stock Mitsuba is made on
those.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from burrscan.arrays import Floats32, Ints, Ints32

_SHARE = 0.05
TILE = 16
_LEVELS = 4


@nb.njit(cache=True)
def _tile(pixel: int, width: int, rows: int, level: int) -> tuple[int, int, int, int]:
    """Rows and columns of the aligned tile of a level around a pixel."""
    side = 1 << level
    i0, j0 = (pixel // width) // side * side, (pixel % width) // side * side
    return i0, min(i0 + side, rows), j0, min(j0 + side, width)


@nb.njit(cache=True)
def _level(share: float, direct: float) -> int:
    """The smallest tile, 2×2 at least, that brings a sample's share below the limit."""
    level = 1
    share *= 0.25
    while level < _LEVELS and share > _SHARE * direct:
        level += 1
        share *= 0.25
    return level


@nb.njit(cache=True)
def _levels(pixel: Ints32, weight: Floats32, reference: Floats32) -> Ints:
    levels = np.empty(pixel.size, np.int64)
    for s in range(pixel.size):
        levels[s] = _level(weight[s], reference[pixel[s]])
    return levels


@nb.njit(cache=True)
def _receivers(pixel: Ints32, levels: Ints, lit: Floats32, width: int) -> Ints:
    """How many pixels share each sample."""
    rows = lit.size // width
    counts = np.ones(pixel.size, np.int64)
    for s in range(pixel.size):
        if levels[s]:
            i0, i1, j0, j1 = _tile(pixel[s], width, rows, levels[s])
            n = 0
            for i in range(i0, i1):
                for j in range(j0, j1):
                    n += lit[i * width + j] > 0.0
            counts[s] = n
            if n == 0:
                levels[s], counts[s] = 0, 1
    return counts


@nb.njit(cache=True)
def _hand_out(pixel: Ints32, levels: Ints, counts: Ints, lit: Floats32, width: int) -> tuple[Ints32, Ints]:
    """The receiving pixel and the sample of every part."""
    rows = lit.size // width
    receiver = np.empty(counts.sum(), np.int32)
    sample = np.empty(counts.sum(), np.int64)
    k = 0
    for s in range(pixel.size):
        if levels[s] == 0:
            receiver[k], sample[k] = pixel[s], s
            k += 1
            continue
        i0, i1, j0, j1 = _tile(pixel[s], width, rows, levels[s])
        for i in range(i0, i1):
            for j in range(j0, j1):
                if lit[i * width + j] > 0.0:
                    receiver[k], sample[k] = i * width + j, s
                    k += 1
    return receiver, sample


def share(
    pixel: Ints32, u_px: Floats32, v_px: Floats32, weight: Floats32, *, direct: Floats32
) -> tuple[Ints32, Floats32, Floats32, Floats32]:
    """Share interreflected samples among neighbouring pixels.

    Parameters
    ----------
    pixel, u_px, v_px, weight
        (S,) camera pixel, projector coordinates and light of each sample.
    direct
        (rows, width) direct light of each camera pixel; rows start on a multiple of :data:`TILE`.

    Returns
    -------
    The same of every part. O(parts).

    """
    lit = direct.ravel()
    width = direct.shape[1]
    reference = np.where(lit > 0.0, lit, _tile_means(direct).ravel())
    levels = _levels(pixel, weight, reference)
    counts = _receivers(pixel, levels, lit, width)
    receiver, sample = _hand_out(pixel, levels, counts, lit, width)
    return receiver, u_px[sample], v_px[sample], (weight / counts.astype(np.float32))[sample]


def _tile_means(direct: Floats32) -> Floats32:
    """Mean of each pixel's 16×16 tile: what a pixel without direct light of its own is compared with."""
    rows, width = direct.shape
    padded = np.zeros((-(-rows // TILE) * TILE, -(-width // TILE) * TILE), np.float32)
    padded[:rows, :width] = direct
    means = padded.reshape(padded.shape[0] // TILE, TILE, -1, TILE).mean(axis=(1, 3))
    return np.kron(means, np.ones((TILE, TILE), np.float32))[:rows, :width]
