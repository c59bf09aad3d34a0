"""Where the light of a pixel comes from: places that its neighbours' paths found, for others to aim at.

On polished metal a path that follows the reflection rarely meets the narrow highlight on the next surface,
and carries very much light when it does. Learning where light comes from out of earlier paths is path guiding
(Jensen 1995; Vorba et al. 2014); here places are kept, not directions, for a burr's flank sees them from a
millimetre away.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numba as nb
import numpy as np

from burrscan.arrays import Bools, Floats32, Ints, Ints32
from scenes.transport.arrivals import Finds, Gathered
from scenes.transport.rows import scattered
from scenes.transport.turn import TARGETS

_REACH = 2
"""Paths of 5 × 5 pixels are learnt from."""


class Aim(NamedTuple):
    """What some pixels aim at: ``points_mm`` (P, TARGETS, 3), and whether they know of any place (P,)."""

    points_mm: Floats32
    known: Bools


def found(parts: list[tuple[Ints, Gathered]], count: int) -> list[Finds]:
    """Per turn, paths with light of ``count`` camera pixels; of several parts of a pixel the last holds."""
    return [
        _joined([(pixels, one.finds[turn]) for pixels, one in parts], count)
        for turn in range(len(parts[0][1].finds))
    ]


def _joined(parts: list[tuple[Ints, Finds]], count: int) -> Finds:
    firsts = np.cumsum([0, *(len(one.points_mm) for _, one in parts)])
    light = [
        (pixels, replace(one.light, columns=one.light.columns + np.int32(first)))
        for (pixels, one), first in zip(parts, firsts[:-1].tolist(), strict=True)
    ]
    return Finds(scattered(light, count), np.concatenate([one.points_mm for _, one in parts]))


def aim_of(pixels: Ints, finds: Finds, shape: tuple[int, int]) -> Aim:
    """Choose places for flat camera pixels, drawn by light from their neighbourhood's finds.

    Systematic resampling: a place is chosen as often as its share of the light says.
    O(pixels × finds around). In one thread: waiting for others costs more than the work.
    """
    rows = finds.light
    return Aim(*_resampled(pixels, rows.starts, rows.columns, rows.values, finds.points_mm, *shape))


@nb.njit(cache=True)
def _resampled(
    pixels: Ints, starts: Ints, paths: Ints32, light: Floats32, points: Floats32, height: int, width: int
) -> tuple[Floats32, Bools]:
    chosen = np.zeros((pixels.size, TARGETS, 3), np.float32)
    known = np.zeros(pixels.size, np.bool_)
    for p in range(pixels.size):
        rows = _rows_around(pixels[p], height, width)
        total = 0.0
        for first, last in rows:
            total += light[starts[first] : starts[last]].sum()
        if total > 0.0:
            known[p] = True
            _choose(chosen[p], rows, starts, paths, light, points, total)
    return chosen, known


@nb.njit(cache=True)
def _rows_around(pixel: int, height: int, width: int) -> list[tuple[int, int]]:
    """First and last but one flat pixel of each row of the neighbourhood."""
    i, j = pixel // width, pixel % width
    left, right = max(j - _REACH, 0), min(j + _REACH + 1, width)
    return [
        (y * width + left, y * width + right) for y in range(max(i - _REACH, 0), min(i + _REACH + 1, height))
    ]


@nb.njit(cache=True)
def _choose(
    chosen: Floats32,
    rows: list[tuple[int, int]],
    starts: Ints,
    paths: Ints32,
    light: Floats32,
    points: Floats32,
    total: float,
) -> None:
    """Fill ``chosen`` with places at even steps of the running sum of the light."""
    passed, n = 0.0, 0
    for first, last in rows:
        for k in range(starts[first], starts[last]):
            passed += light[k]
            while n < TARGETS and passed >= (n + 0.5) / TARGETS * total:
                for axis in range(3):
                    chosen[n, axis] = points[paths[k], axis]
                n += 1
    while 0 < n < TARGETS:  # rounding left the last place open
        for axis in range(3):
            chosen[n, axis] = chosen[n - 1, axis]
        n += 1
