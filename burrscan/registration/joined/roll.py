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

_SIGNIFICANT = 5.0
"""Standard deviations of a slope: chance makes one of two millions so steep."""
_FEWEST_PLACES = 10
"""With fewer a single stray edge would turn a view."""
_FEWEST_POINTS = 3.0
"""A place with fewer has no mean to speak of."""
_POINTS_A_BIN = 8.0
"""On average."""
_TURN_SHARE = 0.4
"""Of a turn that a view shows: 140 degrees."""
_ACROSS = 1.0 / 12.0
"""Variance of a place within its bin, in squared widths."""


class HeightMap(NamedTuple):
    """Means of what stands off the curve, and how many points they are of: (pieces, bins of angle) each."""

    height_mm: Floats
    count: Floats


def bins_of(curve: Curve, points: float) -> int:
    """Bins of a turn: a quarter of a piece wide, or so that a view of ``points`` fills them."""
    mean_r = float(np.mean(curve.centre[:, 1]))
    filled = points / (_POINTS_A_BIN * _TURN_SHARE * len(curve.centre))
    return max(16, int(min(8.0 * np.pi * mean_r / curve.spacing, filled)))


def height_map(points: Floats, pose: Floats, curve: Curve, *, bins: int) -> HeightMap:
    """The height map of a view's (V, 3) points at its pose. O(V)."""
    total, count = _sums(points, pose, curve, bins)
    return HeightMap(total / np.maximum(count, 1.0), count)


@kernel
def _sums(points: Floats, pose: Floats, curve: Curve, bins: int) -> tuple[Floats, Floats]:
    total, count = np.zeros((curve.centre.shape[0], bins)), np.zeros((curve.centre.shape[0], bins))
    for i in range(points.shape[0]):
        a, b, c = points[i, 0], points[i, 1], points[i, 2]
        x = pose[0, 0] * a + pose[0, 1] * b + pose[0, 2] * c + pose[0, 3]
        y = pose[1, 0] * a + pose[1, 1] * b + pose[1, 2] * c + pose[1, 3]
        z = pose[2, 0] * a + pose[2, 1] * b + pose[2, 2] * c + pose[2, 3]
        r = np.sqrt(x * x + y * y)
        k = piece_of(z, r, curve)
        if k < 0:
            continue
        _, d, _, _ = off_piece(z, r, k, curve)
        m = int((np.arctan2(y, x) / (2.0 * np.pi) + 0.5) * bins) % bins
        total[k, m] += d
        count[k, m] += 1.0
    return total, count


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
    both = (one.count >= _FEWEST_POINTS) & (other.count >= _FEWEST_POINTS)
    inside = both & np.roll(both, 1, axis=1) & np.roll(both, -1, axis=1)
    if inside.sum() < _FEWEST_PLACES:
        return 0.0, 0.0
    width = 2.0 * np.pi / one.height_mm.shape[1]
    variance = [noise_one**2 / np.maximum(one.count, 1.0), noise_other**2 / np.maximum(other.count, 1.0)]
    mean = 0.5 * (one.height_mm + other.height_mm)
    slope = (np.roll(mean, -1, axis=1) - np.roll(mean, 1, axis=1)) / (2.0 * width)
    each = 0.25 * (variance[0] + variance[1])
    lean = (np.roll(each, -1, axis=1) + np.roll(each, 1, axis=1)) / (2.0 * width) ** 2
    steep = inside & (slope**2 > _SIGNIFICANT**2 * lean)
    if steep.sum() < _FEWEST_PLACES:
        return 0.0, 0.0
    within = _ACROSS * width**2 * (1.0 / one.count[steep] + 1.0 / other.count[steep])
    slope, lean = slope[steep], lean[steep]
    weight = 1.0 / (variance[0][steep] + variance[1][steep] + slope**2 * within)
    # a view that turns forwards carries its heights along: at a place the height falls by the slope
    apart = (one.height_mm - other.height_mm)[steep]
    told = float(weight @ (slope**2 - lean))
    turn = float(weight @ (slope * apart)) / told
    excess = max(1.0, float(weight @ (apart - slope * turn) ** 2) / len(slope))
    return told / excess, -told * turn / excess
