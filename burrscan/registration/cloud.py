"""A view made ready for comparison: normals, borders, a search tree, and the samples that are compared."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from burrscan.arrays import Bools, Floats, Ints, Ints32
from burrscan.errors import InputError
from burrscan.registration.alignment import PosedSurface

_FEWEST = 100
"""Vertices on faces: with fewer there is no surface to align six unknowns by."""
_ROUNDS = 6
"""Of averaging over neighbours: reaches about √6 edges, enough to average noise off a normal and no edge
away."""
_LOPSIDED = 0.5
"""In pitches: where the middle of the surroundings is this far off, they lie to one side, as at a border."""
_BENT = 0.2
"""Thickness of the surroundings over their lesser width, from which they are an edge and no plane."""


@dataclass(frozen=True)
class Cloud:
    """The vertices that have a normal, in the camera frame.

    Parameters
    ----------
    points_mm, normals
        (V, 3).
    middles_mm
        (V, 3) the middle of every vertex's surroundings: where its normal is that of the surface.
    sigma_mm
        (V,).
    border
        (V,) True at and beside the rim of the mesh, where the nearest vertex need not be the nearest place
        and normals lean.
    samples
        (S,) indices of the vertices that are compared with other views.
    tree
        Over the points.
    pitch_mm
        Median distance between neighbours.

    """

    points_mm: Floats
    normals: Floats
    middles_mm: Floats
    sigma_mm: Floats
    border: Bools
    samples: Ints
    tree: cKDTree
    pitch_mm: float


def cloud_of(view: PosedSurface, *, samples: int, rng: np.random.Generator, name: str) -> Cloud:
    """Prepare a view. O(V log V).

    Raises
    ------
    InputError
        When the mesh has hardly any faces: without faces there are no normals.

    """
    used, normals = _normals(view.vertices_mm, view.faces)
    if used.sum() < _FEWEST:
        raise InputError(f"{name}: only {used.sum()} vertices lie on faces; an alignment needs a mesh")
    normals, middles, shift, bent = _planes(
        normals, np.where(used[:, None], view.vertices_mm, 0.0), view.faces
    )
    points = np.ascontiguousarray(view.vertices_mm[used])
    chosen = np.sort(rng.permutation(len(points))[:samples])
    tree = cKDTree(points)
    apart = np.asarray(tree.query(points[chosen[:1000]], k=2)[0])
    pitch = float(np.median(apart[:, 1]))
    border = (
        _on_border(len(view.vertices_mm), view.faces)[used] | (shift[used] > _LOPSIDED * pitch) | bent[used]
    )
    return Cloud(points, normals[used], middles[used], view.sigma_mm[used], border, chosen, tree, pitch)


def _normals(vertices_mm: Floats, faces: Ints32) -> tuple[Bools, Floats]:
    """(V,) vertices on a face of some area, and (V, 3) unit normals, weighted by the faces' areas."""
    a, b, c = (vertices_mm[faces[:, corner]] for corner in range(3))
    cross = np.cross(b - a, c - a)
    whole = np.isfinite(cross).all(axis=1)
    corners, areas = faces[whole].ravel(), np.repeat(cross[whole], 3, axis=0)
    total = np.stack([np.bincount(corners, areas[:, k], len(vertices_mm)) for k in range(3)], axis=1)
    length = np.linalg.norm(total, axis=1)
    return length > 0.0, total / np.maximum(length, np.finfo(float).tiny)[:, None]


def _planes(normals: Floats, points_mm: Floats, faces: Ints32) -> tuple[Floats, Floats, Floats, Bools]:
    """Normals and middles of the planes through every vertex's surroundings, and how lopsided those are, mm.

    Noise in the normals of a surface of revolution looks like information about the turn that slides it along
    itself (errors in variables), and so does any lean. Surroundings of some forty vertices leave little of
    the noise; the plane of least squares does not lean with the diagonals of the faces, as a mean of their
    normals does. Beside a rim it does lean: (V,) is how far the middle of the surroundings is off, sideways.

    Notes
    -----
    The moments are averaged over neighbours, a few times over. O(V + T).
    """
    count = len(normals)
    edges = _sides(points_mm, faces)
    ends = np.concatenate([edges, edges[:, ::-1]])
    joined = sparse.csr_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(count, count))
    share = 1.0 / (1.0 + np.asarray(joined.sum(axis=1)))[:, None]
    local = points_mm - points_mm.mean(axis=0)
    moments = np.concatenate([local, (local[:, :, None] * local[:, None, :]).reshape(count, 9)], axis=1)
    for _ in range(_ROUNDS):
        moments = share * (moments + joined @ moments)
    middle = moments[:, :3]
    scatter = moments[:, 3:].reshape(count, 3, 3) - middle[:, :, None] * middle[:, None, :]
    spread, axes = np.linalg.eigh(scatter)
    plane = axes[:, :, 0]
    plane *= np.where(np.einsum("ij,ij->i", plane, normals) < 0.0, -1.0, 1.0)[:, None]
    off = middle - local
    sideways = off - np.einsum("ij,ij->i", off, plane)[:, None] * plane
    bent = spread[:, 0] > _BENT**2 * spread[:, 1]
    return plane, middle + points_mm.mean(axis=0), np.linalg.norm(sideways, axis=1).astype(float), bent


def _sides(points_mm: Floats, faces: Ints32) -> Ints32:
    """(E, 2) the edges but for the longest of every face: a range image's diagonals all lean one way.

    Surroundings that are sheared by them give leaning normals where the surface is curved, and views of a
    surface of revolution then creep about its axis.
    """
    edges = np.stack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]], axis=1)
    square = ((points_mm[edges[..., 0]] - points_mm[edges[..., 1]]) ** 2).sum(axis=2)
    kept: Ints32 = edges[np.arange(3) != np.argmax(square, axis=1)[:, None]]
    return kept


def _on_border(count: int, faces: Ints32) -> Bools:
    """(V,) vertices of edges that only one face has."""
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    key = edges[:, 0].astype(np.int64) * count + edges[:, 1]
    _, first, times = np.unique(key, return_index=True, return_counts=True)
    border = np.zeros(count, dtype=bool)
    border[edges[first[times == 1]].ravel()] = True
    return border
