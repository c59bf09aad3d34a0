"""A view at its working scale: the points of every cell become one, with the noise that is left."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from burrscan.arrays import Floats, Ints, Ints32

_WORTH = 2.0
"""Cells less than this many pitches wide hold a point or two: averaging them would cost shape and save
nothing."""
_AROUND = 16
"""Cells that a surface's plane is taken from: those of two slabs, and of the eight places around."""


@dataclass(frozen=True)
class Averaged:
    """Points that stand for many.

    Parameters
    ----------
    points_mm
        (P, 3) means.
    sigma_mm
        (P,) standard deviation of each.
    count
        (P,) how many points it stands for.
    outwards
        (P, 3) sum of the faces' areas as vectors: which side was seen. Zero for a cloud. A triangle that
        noise folded over takes away as much as its neighbours have too much.

    """

    points_mm: Floats
    sigma_mm: Floats
    count: Floats
    outwards: Floats


def averaged(
    points_mm: Floats, sigma_mm: Floats, faces: Ints32, *, pitch_mm: float, working_mm: float
) -> Averaged:
    """Average (V, 3) points over the working scale, where it is well above the pitch. O(V log V).

    Every point goes to the nearest of some places on the surface, a working scale apart: what is averaged
    reaches through all of the noise.
    """
    areas = _areas(points_mm, faces)
    if working_mm < _WORTH * pitch_mm:
        return Averaged(points_mm, sigma_mm, np.ones(len(points_mm)), areas)
    places = _on_surface(*_cells(points_mm, working_mm))
    places, _ = _cells(places, working_mm)
    _, cell = cKDTree(places).query(points_mm)
    cell = np.unique(cell, return_inverse=True)[1].reshape(-1)
    count = np.bincount(cell)
    return Averaged(
        points_mm=_summed(points_mm, cell) / count[:, None],
        sigma_mm=np.sqrt(np.bincount(cell, sigma_mm**2)) / count,
        count=count.astype(float),
        outwards=_summed(areas, cell),
    )


def _cells(points_mm: Floats, side_mm: float) -> tuple[Floats, Floats]:
    """(C, 3) means of the points in the cells of a cubic grid, and how many those are."""
    place = np.floor((points_mm - points_mm.min(axis=0)) / side_mm).astype(np.int64)
    sides = place.max(axis=0) + 1
    key = (place[:, 0] * sides[1] + place[:, 1]) * sides[2] + place[:, 2]
    _, cell, count = np.unique(key, return_inverse=True, return_counts=True)
    return _summed(points_mm, cell.reshape(-1)) / count[:, None], count.astype(float)


def _on_surface(means_mm: Floats, count: Floats) -> Floats:
    """Means of cells, moved to the plane through those around them, which count by their points.

    A cell's side may cut the noise lengthwise: its mean is then off to one side, and so would be what is
    averaged around it.
    """
    _, near = cKDTree(means_mm).query(means_mm, k=min(_AROUND, len(means_mm)))
    weight = count[near] / count[near].sum(axis=1, keepdims=True)
    around = means_mm[near]
    middle = np.einsum("nk,nki->ni", weight, around)
    local = around - middle[:, None]
    _, axes = np.linalg.eigh(np.einsum("nk,nki,nkj->nij", weight, local, local, optimize=True))
    normal = axes[:, :, 0]
    off = np.einsum("ni,ni->n", means_mm - middle, normal)
    return np.asarray(means_mm - off[:, None] * normal)


def _areas(points_mm: Floats, faces: Ints32) -> Floats:
    """(V, 3) sum of the vector areas of each vertex's faces, doubled."""
    a, b, c = (points_mm[faces[:, corner]] for corner in range(3))
    cross = np.repeat(np.cross(b - a, c - a), 3, axis=0)
    return np.stack([np.bincount(faces.ravel(), cross[:, k], len(points_mm)) for k in range(3)], axis=1)


def _summed(values: Floats, cell: Ints) -> Floats:
    return np.stack([np.bincount(cell, values[:, k]) for k in range(values.shape[1])], axis=1)
