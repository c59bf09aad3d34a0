"""What is not round tells how views are turned about the axis against each other.

Off the curve stand burrs, bosses, spokes and keyways. Laid out over angle and place along the curve, they are
a height map; two views that show the same of it must agree. Where a map slopes along the angle, its
difference to the other tells of the turn between the two. Noise slopes as well: only places whose slope is
significant take part, and what their noise feigns is taken off.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from burrscan.arrays import Floats
from burrscan.axis.fitting.fit import Curve, off_piece, piece_of
from burrscan.axis.jit import kernel
from burrscan.registration.joined.points import SECTORS, at

_SIGNIFICANT = 5.0
"""Standard deviations of a slope: chance makes one of two millions so steep."""
_FEWEST_PLACES = 10
"""With fewer a single stray edge would turn a view."""
_FEWEST_SECTORS = 3
"""Of 5.6 degrees with something steep: their disagreement says how sure the turn is."""
_FEWEST_POINTS = 3.0
"""A place with fewer has no mean to speak of."""
_POINTS_A_BIN = 8.0
"""On average."""
_TURN_SHARE = 0.4
"""Of a turn that a view shows: 140 degrees."""
_ACROSS = 1.0 / 12.0
"""Variance of a place within its bin, in squared widths: what a mean may be off where the slope bends."""


class HeightMap(NamedTuple):
    """What stands off the curve, per piece and bin of angle.

    Parameters
    ----------
    height_mm
        Mean height of the points.
    off
        Mean angle of the points less that of the bin's middle, rad: a bin holds a few columns of a grid, and
        where they lie in it decides the mean of a slope.
    points
        How many those are.

    """

    height_mm: Floats
    off: Floats
    points: Floats


def bins_of(curve: Curve, points: float) -> int:
    """Bins of a turn: a quarter of a piece wide, or so that a view of ``points`` fills them."""
    mean_r = float(np.mean(curve.centre[:, 1]))
    filled = points / (_POINTS_A_BIN * _TURN_SHARE * len(curve.centre))
    return max(16, int(min(8.0 * np.pi * mean_r / curve.spacing, filled)))


def height_map(points: Floats, pose: Floats, curve: Curve, *, bins: int) -> HeightMap:
    """The height map of a view's (V, 3) points at its pose. O(V)."""
    height, off, count = _sums(points, pose, curve, bins)
    return HeightMap(height / np.maximum(count, 1.0), off / np.maximum(count, 1.0), count)


@kernel
def _sums(points: Floats, pose: Floats, curve: Curve, bins: int) -> tuple[Floats, Floats, Floats]:
    shape = (curve.centre.shape[0], bins)
    total, off, count = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    for i in range(points.shape[0]):
        x, y, z, r = at(points[i], pose)
        k = piece_of(z, r, curve)
        if k < 0:
            continue
        _, d, _, _ = off_piece(z, r, k, curve)
        place = (np.arctan2(y, x) / (2.0 * np.pi) + 0.5) * bins
        m = int(place) % bins
        total[k, m] += d
        off[k, m] += (place - int(place) - 0.5) * 2.0 * np.pi / bins
        count[k, m] += 1.0
    return total, off, count


def roll_rows(maps: Sequence[HeightMap], noise_mm: Floats) -> tuple[Floats, Floats]:
    """Normal equations (N, N) and (N,) of every view's turn in radians, from all views that overlap."""
    count = len(maps)
    square, pull = np.zeros((count, count)), np.zeros(count)
    for i, j in combinations(range(count), 2):
        told, wanted = _between(maps[i], maps[j], noise_mm[i], noise_mm[j])
        square[i, i] += told
        square[j, j] += told
        square[i, j] -= told
        square[j, i] -= told
        pull[i] += wanted
        pull[j] -= wanted
    return square, pull


def _between(one: HeightMap, other: HeightMap, noise_one: float, noise_other: float) -> tuple[float, float]:
    """What two maps tell of the turn of one against the other: information and pull."""
    both = (one.points >= _FEWEST_POINTS) & (other.points >= _FEWEST_POINTS)
    inside = both & np.roll(both, 1, axis=1) & np.roll(both, -1, axis=1)
    width = 2.0 * np.pi / one.height_mm.shape[1]
    own, others = noise_one**2 / np.maximum(one.points, 1.0), noise_other**2 / np.maximum(other.points, 1.0)
    height, off = 0.5 * (one.height_mm + other.height_mm), 0.5 * (one.off + other.off)
    run = 2.0 * width + np.roll(off, -1, axis=1) - np.roll(off, 1, axis=1)
    slope = (np.roll(height, -1, axis=1) - np.roll(height, 1, axis=1)) / run
    each = 0.25 * (own + others)
    lean = (np.roll(each, -1, axis=1) + np.roll(each, 1, axis=1)) / run**2
    steep = inside & (slope**2 > _SIGNIFICANT**2 * lean)
    if steep.sum() < _FEWEST_PLACES:
        return 0.0, 0.0
    apart = (one.height_mm - other.height_mm - slope * (one.off - other.off))[steep]
    slope, lean, bent = slope[steep], lean[steep], _ACROSS * (slope[steep] * width) ** 2
    weight = 1.0 / (own[steep] + others[steep] + bent)
    told = float(weight @ np.maximum(slope**2 - lean, 0.0))
    # a view that turns forwards carries its heights along: at a place the height falls by the slope
    turn = float(weight @ (slope * apart)) / told
    sector = np.nonzero(steep)[1] * SECTORS // one.height_mm.shape[1]
    pulls = np.bincount(sector, weight * slope * (apart - slope * turn))
    sectors = np.count_nonzero(np.bincount(sector))
    if sectors < _FEWEST_SECTORS:
        return 0.0, 0.0
    excess = max(1.0, float(pulls @ pulls) / told * sectors / (sectors - 1.0))
    return told / excess, -told * turn / excess
