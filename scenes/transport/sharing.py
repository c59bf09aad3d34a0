"""Sharing interreflected light among neighbours: a few random paths stand for an integral.

Real interreflected light is smooth over neighbouring camera pixels: it comes by way of a rough lobe, some ten
degrees wide even on polished metal, off a surface millimetres away. Sixteen random paths per pixel are not
smooth: one that carries much (a dark pixel that happens to see a highlight) makes the pixel glow alone, and a
handful of paths follows patterns so fine that the integral would wash them out, which ruins a decoder that
relies on just that. So the pixels of a 4×4 tile share what they found, in equal parts, and a sample that is
too bright is shared among those of the smallest tile, 8×8 or 16×16, that brings its part below 5 % of the
pixel's direct light. No light is lost, and the mean over aligned tiles of 16×16 pixels is kept: the test
against stock Mitsuba is made on those. What is lost is the detail of an interreflected image below 4 pixels,
about a millimetre on the default rig.
"""

from __future__ import annotations

from typing import NamedTuple

import numba as nb
import numpy as np

from burrscan.arrays import Bools, Floats32, Ints, Ints32
from scenes.transport.tiles import SIDES, TILE, receivers, tiles_of

_SHARE = 0.05


class Shared(NamedTuple):
    """Samples of one size of tile: the tile, projector column and row, and each receiving pixel's part."""

    tile: Ints32
    u_px: Floats32
    v_px: Floats32
    weight: Floats32


def share(
    pixel: Ints32, u_px: Floats32, v_px: Floats32, weight: Floats32, *, direct: Floats32, receives: Bools
) -> tuple[Shared, ...]:
    """Hand interreflected samples to tiles of pixels.

    Parameters
    ----------
    pixel, u_px, v_px, weight
        (S,) camera pixel, projector coordinates and light of each sample.
    direct
        (rows, width) direct light of each camera pixel; rows start on a multiple of :data:`TILE`.
    receives
        (rows, width) of :func:`receiving`.

    Returns
    -------
    The samples that go to each of the :data:`SIDES`. O(samples).

    """
    reference = np.where(direct > 0.0, direct, _tile_means(direct)).ravel()
    levels = _levels(pixel, weight, reference, np.array([side * side for side in SIDES], np.float32))
    shared = []
    for level, side in enumerate(SIDES):
        chosen = np.flatnonzero(levels == level)
        tile = tiles_of(pixel[chosen], width=direct.shape[1], side=side)
        count = receivers(receives, side=side).ravel()[tile]
        part = np.divide(weight[chosen], count, dtype=np.float32)
        shared.append(Shared(tile, u_px[chosen], v_px[chosen], part))
    return tuple(shared)


def receiving(direct: Floats32) -> Bools:
    """Which pixels (rows, width) take part: the lit ones, and all of a smallest tile that has none."""
    lit = direct > 0.0
    side = SIDES[0]
    none = receivers(lit, side=side) == 0
    everywhere = none.repeat(side, axis=0).repeat(side, axis=1)[: lit.shape[0], : lit.shape[1]]
    return np.asarray(lit | everywhere)


@nb.njit(cache=True)
def _levels(pixel: Ints32, weight: Floats32, reference: Floats32, areas: Floats32) -> Ints:
    """The smallest size of tile that brings each sample's part below the limit."""
    levels = np.zeros(pixel.size, np.int64)
    for s in range(pixel.size):
        limit = np.float32(_SHARE) * reference[pixel[s]]
        while levels[s] < areas.size - 1 and weight[s] > limit * areas[levels[s]]:
            levels[s] += 1
    return levels


def _tile_means(direct: Floats32) -> Floats32:
    """Mean of each pixel's 16×16 tile: what a pixel without direct light of its own is compared with."""
    rows, width = direct.shape
    padded = np.zeros((-(-rows // TILE) * TILE, -(-width // TILE) * TILE), np.float32)
    padded[:rows, :width] = direct
    means = padded.reshape(padded.shape[0] // TILE, TILE, -1, TILE).mean(axis=(1, 3))
    return np.kron(means, np.ones((TILE, TILE), np.float32))[:rows, :width]
