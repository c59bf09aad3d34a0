"""A mesh small enough to be kept and looked at: vertices of one cell of space become one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from burrscan.arrays import Bools, Floats, Ints, Ints32

_FINER = 2  # cells along an edge of a cell that is divided
_MOST = 5000  # vertices; their numbers have 16 bits
_ROUGH_SHARE = 0.08  # of the cells, those in which the values differ most, are divided
_GROWTH = 1.12
"""Of the cells' side, until few enough are occupied: ends within a quarter of the number wanted."""


@dataclass(frozen=True)
class DecimatedMesh:
    """A decimated mesh.

    Parameters
    ----------
    vertices_mm
        (V, 3) means of the vertices of each cell.
    faces
        (F, 3) without those that lie within one cell.
    values
        (V,) means of the values of each cell; NaN where none is known.

    """

    vertices_mm: NDArray[np.float32]
    faces: NDArray[np.uint16]
    values: NDArray[np.float16]


def decimated_mesh(vertices_mm: Floats, faces: Ints32, values: Floats) -> DecimatedMesh:
    """Merge the vertices that share a cell of space, with cells as small as 5000 vertices permit.

    Vertex clustering (Rossignac and Borrel 1993). Cells in which the values differ most are divided again,
    so that what stands out of a smooth surface keeps its shape. O(N log N) for each of a few cell sizes.

    Parameters
    ----------
    vertices_mm
        (N, 3), NaN rows are no vertices.
    faces
        (M, 3).
    values
        (N,) such as deviations, NaN where unknown.

    """
    used = np.unique(faces[np.isfinite(vertices_mm[faces]).all(axis=(1, 2))])
    if not used.size:
        return DecimatedMesh(
            np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint16), np.zeros(0, np.float16)
        )
    points, known = vertices_mm[used], values[used]
    group = _groups(points, known)
    count = int(group.max()) + 1
    places = np.column_stack([_mean(points[:, k], group, count) for k in range(3)])
    number = np.full(len(vertices_mm), -1)
    number[used] = group
    return DecimatedMesh(
        places.astype(np.float32),
        _between(number[faces]).astype(np.uint16),
        _mean(known, group, count).astype(np.float16),
    )


def _groups(points: Floats, values: Floats) -> Ints:
    """(N,) number of each vertex's cell, with the smallest cells that do."""
    size = float(np.linalg.norm(np.ptp(points, axis=0))) / (2.0 * np.sqrt(_MOST)) + 1e-6
    group = _cells(points, values, size)
    while int(group.max()) >= _MOST:
        size *= _GROWTH
        group = _cells(points, values, size)
    return group


def _cells(points: Floats, values: Floats, size: float) -> Ints:
    corner = points.min(axis=0)
    coarse = _numbered(np.floor((points - corner) / size))
    rough = _rough(values, coarse)
    fine = np.floor((points - corner) / (size / _FINER)) % _FINER
    return _numbered(np.column_stack([coarse, np.where(rough[:, None], fine, -1.0)]))


def _rough(values: Floats, group: Ints) -> Bools:
    """(N,) whether a vertex's cell is among those with the greatest range of values."""
    count = int(group.max()) + 1
    low, high = np.full(count, np.inf), np.full(count, -np.inf)
    known = np.isfinite(values)
    np.minimum.at(low, group[known], values[known])
    np.maximum.at(high, group[known], values[known])
    spread = np.where(high >= low, high - low, 0.0)
    return np.asarray(spread > np.quantile(spread, 1.0 - _ROUGH_SHARE))[group]


def _numbered(keys: Floats) -> Ints:
    """(N,) number of each row among the different ones, in their lexical order."""
    return np.unique(_packed(keys.astype(np.int64)), return_inverse=True)[1].reshape(-1)


def _packed(rows: Ints) -> Ints:
    """(N,) one number per row, in the rows' lexical order: to sort rows takes ten times as long."""
    digits = rows - rows.min(axis=0)
    return np.asarray(np.ravel_multi_index(tuple(digits.T), digits.max(axis=0) + 1))


def _mean(values: Floats, group: Ints, count: int) -> Floats:
    known = np.isfinite(values)
    total = np.bincount(group[known], values[known], minlength=count)
    with np.errstate(invalid="ignore"):
        return np.asarray(total / np.bincount(group[known], minlength=count), float)


def _between(faces: Ints) -> Ints:
    """Faces between three cells, each once."""
    a, b, c = faces.T
    kept = faces[(a != b) & (b != c) & (a != c) & (faces >= 0).all(axis=1)]
    first = np.argmin(kept, axis=1)[:, None]
    turned = np.take_along_axis(kept, (first + np.arange(3)) % 3, axis=1)
    return turned[np.unique(_packed(turned), return_index=True)[1]] if len(turned) else turned
