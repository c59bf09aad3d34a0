"""Walls of holes and of windows between spokes: beside them is no surface, where beside a burr there is.

One view shows the far wall of an opening and nothing of the near one. The wall falls off from the rim of the
opening as the flank of a nick does, or rises from the other surface as a burr's; but what follows is a gap as
wide as the opening. Beside a burr the surface goes on: what it hides, or mirrors away, is as wide as itself.

So much for meshes. A scan that comes with its pictures is judged by its light: where patterns that do not
adapt fail on metal, up to 0.37 beside true burrs lacks points, and no limit tells them from openings.
"""

from __future__ import annotations

import cv2
import numpy as np

from burrscan.arrays import Floats, Ints32
from burrscan.burrs.detect import Region, integral
from burrscan.burrs.field import Field

WIDE_MM, WIDE = 5.0, 0.1
"""How far around it is looked, mm, and no further than that share of the radius: wider than what a burr
hides, and on a pin still its near side."""
MOST_OPEN = 0.1
"""Share without surface: beside rendered burrs and nicks under adaptive patterns, polished ones too, at
most 0.04; beside walls of windows 0.16 to 0.9."""
_HIGHEST = 2.0 / 3.0
"""Quantile of an anomaly's cells from which they count as its crest, or its ground."""


class Openings:
    """The cells of a field that show no surface, prepared for any number of questions. O(cells)."""

    def __init__(self, field: Field) -> None:
        """Single empty cells between full ones are none, for vertices miss some; nor are rows without any."""
        self._field = field
        self._wide = min(WIDE_MM, WIDE * float(field.foot[:, 1].max()))
        self._wrap = field.count.shape[1] if field.closed else 0
        full = np.pad(field.count > 0.0, ((0, 0), (self._wrap,) * 2), "wrap")
        closed = np.asarray(cv2.morphologyEx(full.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3)))) > 0
        on_curve = field.count.sum(axis=1) > 0.0
        self._rows = np.append(0, np.cumsum(on_curve))
        self._open = integral((on_curve[:, None] & ~closed).astype(np.float64))

    def beside(self, region: Region) -> float:
        """How much of what is around the crest of an anomaly is no surface.

        Returns
        -------
        float
            Median over the highest third of its cells, each of the box within :data:`WIDE_MM` of it.

        """
        field, chosen = self._field, self._field.within(region.cells)
        radius = max(float(np.median(field.foot[chosen, 1])), 1e-9)
        row, column = _highest(field.cell[chosen], region.sign * field.deviation_mm[chosen]).T
        rows, columns = (
            _ends(at, max(round(self._wide / step), 1), size)
            for at, step, size in (
                (row, field.step_mm, len(self._open) - 1),
                (column + self._wrap, field.step_rad * radius, self._open.shape[1] - 1),
            )
        )
        (top, bottom), (left, right) = rows, columns
        counted = (self._rows[bottom] - self._rows[top]) * (right - left)
        sums = self._open
        empty = sums[bottom, right] - sums[top, right] - sums[bottom, left] + sums[top, left]
        return float(np.median(empty / np.maximum(counted, 1)))


def _highest(cell: Ints32, lift: Floats) -> Ints32:
    """(M, 2) the highest third of the cells of some vertices, by the mean of those that each holds."""
    places, each, count = np.unique(cell, axis=0, return_inverse=True, return_counts=True)
    level = np.bincount(each.ravel(), lift) / count
    return np.asarray(places[level >= np.quantile(level, _HIGHEST)])


def _ends(at: Ints32, reach: int, size: int) -> tuple[Ints32, Ints32]:
    return np.maximum(at - reach, 0), np.minimum(at + reach + 1, size)
