"""Sharing interreflected light among neighbours: a few random paths stand for an integral.

Real interreflected light is smooth over neighbouring camera pixels. Sixteen random paths per pixel are not:
one that carries much (a dark pixel that happens to see a highlight) makes the pixel glow alone, and a handful
of paths follows patterns so fine that the integral would wash them out. So every interreflected sample is
shared, in equal parts, among the lit pixels of the 2×2 tile around it, and one that is too bright among those
of the smallest tile, up to 16×16, that brings its share below 5 % of the pixel's direct light. A pixel at
some distance from the one whose path it was would have been lit from another place too: its part comes from a
projector pixel that is off by up to that distance, at random. No light is lost, and the mean over aligned
tiles of 16×16 pixels is kept: the test against stock Mitsuba is made on those.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from burrscan.arrays import Floats32, Ints, Ints32
from scenes.streams import stream_key, uniform

_SHARE = 0.05
_KEY = stream_key((0,), "shared interreflections")
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


@nb.njit(cache=True)
def _displace(
    receiver: Ints32, pixel: Ints32, sample: Ints, u: Floats32, v: Floats32, width: int
) -> tuple[Floats32, Floats32]:
    """Projector coordinates of the parts, off by up to the distance of receiver and sample."""
    out_u, out_v = np.empty(sample.size, np.float32), np.empty(sample.size, np.float32)
    for k in range(sample.size):
        s = sample[k]
        rows = abs(receiver[k] // width - pixel[s] // width)
        reach = max(rows, abs(receiver[k] % width - pixel[s] % width))
        counter = np.uint64(2 * k)
        out_u[k] = u[s] + reach * (2.0 * uniform(_KEY, counter) - 1.0)
        out_v[k] = v[s] + reach * (2.0 * uniform(_KEY, counter + np.uint64(1)) - 1.0)
    return out_u, out_v


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
    u, v = _displace(receiver, pixel, sample, u_px, v_px, width)
    return receiver, u, v, (weight / counts.astype(np.float32))[sample]


def _tile_means(direct: Floats32) -> Floats32:
    """Mean of each pixel's 16×16 tile: what a pixel without direct light of its own is compared with."""
    rows, width = direct.shape
    padded = np.zeros((-(-rows // TILE) * TILE, -(-width // TILE) * TILE), np.float32)
    padded[:rows, :width] = direct
    means = padded.reshape(padded.shape[0] // TILE, TILE, -1, TILE).mean(axis=(1, 3))
    return np.kron(means, np.ones((TILE, TILE), np.float32))[:rows, :width]
