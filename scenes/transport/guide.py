"""In which directions the light of a pixel comes: learnt from the paths of its neighbourhood.

On polished metal a path that follows the reflection rarely meets the narrow highlight on the next surface,
and carries very much light when it does. Learning where light comes from out of earlier paths is path guiding
(Jensen 1995; Vorba et al. 2014; Müller, Gross & Novák 2017). What is learnt is the light that goes on to the
camera, the product of both reflections. It is kept as directions, not as places: near a burr
surfaces are flat and camera and projector far, so that directions hold over some pixels.

A tile of pixels shares a guide, a table of cells that hold equal shares of the light. A Sobol net that is
stretched over it stays evenly spread in every cell, and its error falls as on the unit square.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numba as nb
import numpy as np
from scipy.special import ndtr

from burrscan.arrays import Bools, Floats, Floats32, Ints, Ints32
from scenes.transport.arrivals import Finds, Gathered
from scenes.transport.rows import SparseRows, added, scattered
from scenes.transport.turn import CELLS, STRIPS

_TILE, _MARGIN = 4, 2
"""Pixels in a row that share a guide, and those about them whose paths it is learnt from, too. Guides
of 1, 2 and 4 pixels leave the same error; a margin of 1 leaves a tenth more."""
_BINS = 2 * STRIPS
"""Of the histogram that the cells are cut out of, to either side."""
_SIGMAS = 3.0
"""Half the width of the histogram: what lies beyond is left to the reflection."""
_BROAD = 0.25
"""Width of the guide of a single path with light, rad: it cannot know how far light reaches about it."""
_DOUBT = 8.0
"""Paths of equal light that count as much as that broad guide. From 3 to 20 the error hardly changes."""
_EVEN = 0.15
"""Share of a guide that is even over its width, for light that few paths have met. From 0.1 to 0.2 the error
hardly changes; 0.03 makes a tenth more."""
_SMOOTHINGS = 2
"""Of the histogram, by one bin 1 : 2 : 1 each. With one the error is a few per cent larger."""
_WIDEST = np.sqrt(2.0)
"""Half the side of the largest square that the equal-area map of the sphere, a disc of radius 2, holds."""
_BELL = np.diff(ndtr(np.linspace(-_SIGMAS, _SIGMAS, _BINS + 1))) / (2.0 * ndtr(_SIGMAS) - 1.0)
"""Of a broad guide, in the histogram's bins: normal, for nothing else is known of it."""


class Guide(NamedTuple):
    """How the paths of some pixels choose their direction, in the terms of :class:`turn.Guided`.

    ``tiles`` (P,): number of each pixel's guide. Of each guide, ``known`` (T,): whether any light was found;
    ``frames`` (T, 2, 3): its middle, and the axis across which it is cut into strips; ``across``
    (T, STRIPS + 1): the strips' edges; ``along`` (T, STRIPS, CELLS + 1): those of the cells of each.
    """

    tiles: Ints
    known: Bools
    frames: Floats32
    across: Floats32
    along: Floats32


def found(parts: list[tuple[Ints, Gathered]], count: int) -> list[Finds]:
    """Per turn, paths with light of ``count`` camera pixels; of several parts of a pixel the last holds."""
    return [
        _joined([(pixels, one.finds[turn]) for pixels, one in parts], count)
        for turn in range(len(parts[0][1].finds))
    ]


def _joined(parts: list[tuple[Ints, Finds]], count: int) -> Finds:
    rows, directions = _numbered([one for _, one in parts])
    light = [(pixels, row) for (pixels, _), row in zip(parts, rows, strict=True)]
    return Finds(scattered(light, count), directions)


def together(one: Finds, other: Finds) -> Finds:
    """What both found of the same pixels. O(finds)."""
    every = np.arange(one.light.starts.size - 1)
    rows, directions = _numbered([one, other])
    return Finds(added([(every, row, np.ones(every.size)) for row in rows], every.size), directions)


def _numbered(finds: list[Finds]) -> tuple[list[SparseRows], Floats32]:
    """The light of several finds, its columns the numbers of all directions together, and these."""
    firsts = np.cumsum([0, *(len(one.directions) for one in finds)])[:-1].astype(np.int32)
    rows = [
        replace(one.light, columns=one.light.columns + first)
        for one, first in zip(finds, firsts, strict=True)
    ]
    return rows, np.concatenate([one.directions for one in finds])


def guide_of(pixels: Ints, finds: Finds, shape: tuple[int, int]) -> Guide:
    """Learn guides for flat camera pixels from what paths around them found at one turn.

    O(finds around the pixels + tiles · STRIPS · CELLS · bins).
    """
    tiles_a_row = -(-shape[1] // _TILE)
    numbers, tiles = np.unique(
        pixels // shape[1] // _TILE * tiles_a_row + pixels % shape[1] // _TILE, return_inverse=True
    )
    windows = _windows(_TILE * (numbers // tiles_a_row), _TILE * (numbers % tiles_a_row), shape)
    rows = (finds.light.starts, finds.light.columns, finds.light.values, finds.directions, shape[1])
    light, squares, mean, moments = _moments(windows, *rows)
    known = light > 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        doubt = np.where(known, _DOUBT * squares / (_DOUBT * squares + light**2), 1.0)
        moments /= np.where(known, light, 1.0)[:, None, None]
    variances, axes = np.linalg.eigh(moments)  # ascending: the last axis is that of the directions
    middle, side = axes[:, :, 2], axes[:, :, 1]
    middle *= np.where((middle * mean).sum(axis=1) < 0.0, -1.0, 1.0)[:, None]
    frames = np.stack([middle, side], axis=1)
    spread = doubt[:, None] * _BROAD**2 + (1.0 - doubt[:, None]) * np.maximum(variances[:, 1::-1], 0.0)
    half = np.minimum(_SIGMAS * np.sqrt(spread), _WIDEST)
    return Guide(tiles, known, frames.astype(np.float32), *_cut(windows, *rows, frames, half, doubt))


def _windows(top: Ints, left: Ints, shape: tuple[int, int]) -> Ints:
    """(T, 4) first and last but one row, first and last but one column that a tile learns from."""
    reach = _TILE + _MARGIN
    return np.stack(
        [
            np.maximum(top - _MARGIN, 0),
            np.minimum(top + reach, shape[0]),
            np.maximum(left - _MARGIN, 0),
            np.minimum(left + reach, shape[1]),
        ],
        axis=1,
    )


@nb.njit(cache=True)
def _moments(
    windows: Ints, starts: Ints, paths: Ints32, light: Floats32, directions: Floats32, width: int
) -> tuple[Floats, Floats, Floats, Floats]:
    """Sums over each window's paths: light, its square, and with the light directions and their products."""
    count = len(windows)
    sums, squares = np.zeros(count), np.zeros(count)
    mean, moments = np.zeros((count, 3)), np.zeros((count, 3, 3))
    for t in range(count):
        top, bottom, left, right = windows[t]
        for y in range(top, bottom):
            for k in range(starts[y * width + left], starts[y * width + right]):
                one, w = directions[paths[k]], float(light[k])
                sums[t] += w
                squares[t] += w * w
                for i in range(3):
                    mean[t, i] += w * one[i]
                    for j in range(3):
                        moments[t, i, j] += w * one[i] * one[j]
    return sums, squares, mean, moments


@nb.njit(cache=True, parallel=True)
def _cut(
    windows: Ints,
    starts: Ints,
    paths: Ints32,
    light: Floats32,
    directions: Floats32,
    width: int,
    frames: Floats,
    half: Floats,
    doubt: Floats,
) -> tuple[Floats32, Floats32]:
    """Edges of the strips, and of the cells in each, between which a window's light is split evenly."""
    count = len(windows)
    across = np.empty((count, STRIPS + 1), np.float32)
    along = np.empty((count, STRIPS, CELLS + 1), np.float32)
    for t in nb.prange(count):
        table = np.zeros((_BINS, _BINS))
        top, bottom, left, right = windows[t]
        for y in range(top, bottom):
            first, last = starts[y * width + left], starts[y * width + right]
            _add(table, paths[first:last], light[first:last], directions, frames[t], half[t])
        _mix(table, doubt[t])
        edges = np.empty(STRIPS + 1)
        _split(table.sum(axis=1), edges)
        across[t] = half[t, 0] * (edges * (2.0 / _BINS) - 1.0)
        cells = np.empty(CELLS + 1)
        for n in range(STRIPS):
            _split(_between(table, edges[n], edges[n + 1]), cells)
            along[t, n] = half[t, 1] * (cells * (2.0 / _BINS) - 1.0)
    return across, along


@nb.njit(cache=True)
def _add(
    table: Floats, paths: Ints32, light: Floats32, directions: Floats32, frame: Floats, half: Floats
) -> None:
    """Add light to a histogram over the equal-area map, across and along the strips."""
    middle, side = frame
    up = np.cross(middle, side)
    for k in range(paths.size):
        one = directions[paths[k]]
        cosine, a, b = 0.0, 0.0, 0.0
        for i in range(3):
            cosine += middle[i] * one[i]
            a += side[i] * one[i]
            b += up[i] * one[i]
        scale = np.sqrt(2.0 / max(1.0 + cosine, 1e-6))
        a, b = a * scale / half[0], b * scale / half[1]
        if -1.0 < a < 1.0 and -1.0 < b < 1.0:
            table[int(0.5 * _BINS * (a + 1.0)), int(0.5 * _BINS * (b + 1.0))] += light[k]


@nb.njit(cache=True)
def _mix(table: Floats, doubt: float) -> None:
    """Make a histogram a density: smoothed, with the bell of a doubtful guide, and a part that is even."""
    for _ in range(_SMOOTHINGS):
        for i in range(_BINS):
            _smooth(table[i])
            _smooth(table[:, i])
    total = table.sum()
    if total > 0.0:
        table *= (1.0 - doubt) / total
    else:
        doubt = 1.0
    for i in range(_BINS):
        for j in range(_BINS):
            learnt = table[i, j] + doubt * _BELL[i] * _BELL[j]
            table[i, j] = (1.0 - _EVEN) * learnt + _EVEN / _BINS**2


@nb.njit(cache=True)
def _smooth(values: Floats) -> None:
    """Weigh each value with its neighbours, 1 : 2 : 1; what would pass an end stays."""
    before = values[0]
    for i in range(values.size):
        now, after = values[i], values[min(i + 1, values.size - 1)]
        values[i] = 0.25 * before + 0.5 * now + 0.25 * after
        before = now


@nb.njit(cache=True)
def _between(table: Floats, first: float, last: float) -> Floats:
    """Sum of a table's rows between two places."""
    profile = np.zeros(_BINS)
    for i in range(int(first), min(int(np.ceil(last)), _BINS)):
        profile += (min(last, i + 1.0) - max(first, float(i))) * table[i]
    return profile


@nb.njit(cache=True)
def _split(mass: Floats, edges: Floats) -> None:
    """Places, in bins, between which positive mass is split evenly."""
    parts = edges.size - 1
    share = mass.sum() / parts
    edges[0], edges[parts] = 0.0, mass.size
    passed, n = 0.0, 1
    for i in range(mass.size):
        while n < parts and passed + mass[i] >= n * share:
            edges[n] = i + (n * share - passed) / mass[i]
            n += 1
        passed += mass[i]
    edges[n:parts] = mass.size  # rounding left them open
