"""The unrolled map: a surface of revolution laid flat, angle × axial position, in the true part frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from burrscan.arrays import Bools, Floats
from burrscan.turns import turn_deg
from scenes.truth import Truth

_ROW_DEG = 0.4
"""Angle a row of the unrolled map: 0.7 mm on a wheel of 100 mm radius."""
_COLUMN_MM = 0.5
"""Along the axis, a column of the unrolled map."""


@dataclass(frozen=True)
class UnrolledGrid:
    """Cells of angle × axial position in the true part frame: the bounds of a map of one view.

    ``deg`` may run past 180: it is unwrapped about the middle of the view.
    """

    deg: tuple[float, float]
    z_mm: tuple[float, float]

    @property
    def shape(self) -> tuple[int, int]:
        """Rows (angle) and columns (axial position)."""
        rows = round((self.deg[1] - self.deg[0]) / _ROW_DEG)
        return max(rows, 1), max(round((self.z_mm[1] - self.z_mm[0]) / _COLUMN_MM), 1)

    def mean(self, points_mm: Floats, values: Floats) -> NDArray[np.float16]:
        """Mean of ``values`` (N,) at part-frame points (N, 3) in each cell; NaN where there are none."""
        rows, columns = self.shape
        middle = 0.5 * (self.deg[0] + self.deg[1])
        angle = middle + turn_deg(np.degrees(np.arctan2(points_mm[:, 1], points_mm[:, 0])) - middle)
        row = np.floor((angle - self.deg[0]) / _ROW_DEG)
        column = np.floor((points_mm[:, 2] - self.z_mm[0]) / _COLUMN_MM)
        inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns) & np.isfinite(values)
        cell = (row[inside] * columns + column[inside]).astype(np.int64)
        count = np.bincount(cell, minlength=rows * columns)
        total = np.bincount(cell, values[inside], minlength=rows * columns)
        with np.errstate(invalid="ignore"):
            return (total / count).reshape(rows, columns).astype(np.float16)


def seen(truth: Truth) -> Bools:
    """(h, w) pixels whose centre is on the part and which direct light reaches."""
    return truth.lit & np.isfinite(truth.points_mm[..., 2])


def unrolled_grid(truth: Truth) -> UnrolledGrid:
    """The grid that holds everything the camera and the projector both see."""
    return grid_of(truth.points_part_mm[seen(truth)])


def grid_of(points_mm: Floats) -> UnrolledGrid:
    """The grid that holds part-frame points (N, 3)."""
    x, y, z = points_mm.T
    z_mm = (float(np.floor(z.min())), float(np.ceil(z.max())))
    middle = float(np.degrees(np.arctan2(y.mean(), x.mean())))
    turns = turn_deg(np.degrees(np.arctan2(y, x)) - middle)
    return UnrolledGrid((middle + float(turns.min()), middle + float(turns.max())), z_mm)
