"""Closed solids lofted through stations: burrs to unite with a wheel, and tools to cut nicks."""

from __future__ import annotations

from typing import Any

import manifold3d
import numpy as np
from numpy.typing import NDArray

from burrscan.arrays import Bools, Floats, Ints
from scenes.wheel.solid import Solid

_CREASE_COS = np.cos(np.radians(35.0))
"""Cosine of the turn between faces from which an edge stays sharp in the shading."""
_TWIST_COS = np.cos(np.radians(20.0))
"""Cosine of the angle from which a normal on a twisted quadrilateral gives way to its triangle's."""


def loft(stations_mm: Floats, smooth: Bools) -> Solid:
    """Join the rings of consecutive stations, and close both ends.

    Parameters
    ----------
    stations_mm
        (N, M, 3) a plane ring per station, counter-clockwise seen against the direction from station to
        station; it may be concave. v runs along the stations and u across them. Normals are exact for plane
        flanks, smooth across the ring where it is, and smooth along the loft where it turns by less than 35
        degrees from station to station.
    smooth
        (M,) whether the surface is smooth across that point of the ring; at the others it has an edge.

    """
    n, m = stations_mm.shape[:2]
    index = np.arange(n * m).reshape(n, m)
    across = np.roll(index, -1, axis=1)
    # one quadrilateral per station gap and ring side
    quads = np.stack([index[:-1], across[:-1], across[1:], index[1:]], axis=-1)
    corners = stations_mm.reshape(-1, 3)[quads]
    normals = _smoothed(_quad_normals(corners), smooth)
    uvs = _quad_uvs(stations_mm)
    index_corners = _triangles(quads)
    corner_normals = _true_to_triangles(_triangles(normals), _triangles(corners))
    sides = (index_corners, corner_normals, _triangles(uvs))
    caps = [_cap(stations_mm, index, first=first) for first in (True, False)]
    point, normal, uv = (np.concatenate([side, caps[0][i], caps[1][i]]) for i, side in enumerate(sides))
    return _from_corners(stations_mm.reshape(-1, 3), point, normal, uv)


def _quad_normals(corners: Floats) -> Floats:
    """(N - 1, M, 3) unit normals, by the diagonals."""
    normals = np.cross(corners[..., 2, :] - corners[..., 0, :], corners[..., 3, :] - corners[..., 1, :])
    return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-300))


def _smoothed(normals: Floats, smooth: Bools) -> Floats:
    """(N - 1, M, 4, 3) corner normals: averaged with the neighbours, except over creases and edges."""
    before = np.concatenate([normals[:1], normals[:-1]])
    after = np.concatenate([normals[1:], normals[-1:]])
    start, end = (_average(normals, other) for other in (before, after))
    corners = [
        _across(ends, smooth, back=back) for ends, back in ((start, 1), (start, -1), (end, -1), (end, 1))
    ]
    return np.stack(corners, axis=2)


def _across(normals: Floats, smooth: Bools, *, back: int) -> Floats:
    """Each side's normals at its first (``back`` 1) or last (-1) corner, averaged over smooth points."""
    joined = smooth if back == 1 else np.roll(smooth, -1)
    total = normals + np.where(joined[:, None], np.roll(normals, back, axis=1), 0.0)
    return _unit(total, normals)


def _average(normals: Floats, others: Floats) -> Floats:
    smooth = np.einsum("...i,...i", normals, others)[..., None] > _CREASE_COS
    total = normals + np.where(smooth, others, 0.0)
    return _unit(total, normals)


def _unit(total: Floats, normals: Floats) -> Floats:
    """Sums of normals at length 1, or the faces' own: opposite ones, or 0 of a face that has no area."""
    length = np.linalg.norm(total, axis=-1, keepdims=True)
    return np.asarray(np.where(length > 1e-12, total / np.maximum(length, 1e-12), normals))


def _quad_uvs(stations: Floats) -> Floats:
    """(N - 1, M, 4, 2) u across, v along, both scaled by lengths so that dp/du and dp/dv are well defined."""
    n, m = stations.shape[:2]
    side = np.linalg.norm(np.roll(stations, -1, axis=1) - stations, axis=-1).mean(axis=0)
    u = np.concatenate([[0.0], np.cumsum(side)]) / side.sum()
    v = np.linspace(0.0, 1.0, n)
    grid = np.stack(np.broadcast_arrays(u[None, :], v[:, None]), axis=-1)
    here, across = grid[:, :m], grid[:, 1:]
    return np.stack([here[:-1], across[:-1], across[1:], here[1:]], axis=2)


def _triangles(quads: NDArray[Any]) -> NDArray[Any]:
    """Two triangles per quadrilateral: (N - 1, M, 4, ...) to (T, 3, ...)."""
    halves = [quads[:, :, corners] for corners in ((0, 1, 2), (0, 2, 3))]
    return np.concatenate([half.reshape(-1, *half.shape[2:]) for half in halves])


def _true_to_triangles(normals: Floats, corners: Floats) -> Floats:
    """Normals 20 degrees or more off their triangle, on a twisted quadrilateral, give way to its own."""
    own = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    own /= np.maximum(np.linalg.norm(own, axis=1, keepdims=True), 1e-300)
    fits = np.einsum("tci,ti->tc", normals, own) > _TWIST_COS
    return np.where(fits[..., None], normals, own[:, None])


def _cap(stations: Floats, index: Ints, *, first: bool) -> tuple[Ints, Floats, Floats]:
    """The end face, a plane polygon cut into triangles."""
    ring, points = (index[0], stations[0]) if first else (index[-1], stations[-1])
    normal = np.cross(points, np.roll(points, -1, axis=0)).sum(axis=0)
    normal /= np.linalg.norm(normal)
    across = points[0] - points[-3]
    across /= np.linalg.norm(across)
    plane = np.stack([across, np.cross(normal, across)], axis=1)
    flat = (points - points[0]) @ plane
    # sides run counter-clockwise seen against the loft's direction: the last face looks along it
    local = np.asarray(manifold3d.triangulate([flat], -1.0), np.int64)
    local, normal = (local[:, ::-1], -normal) if first else (local, normal)
    return ring[local], np.broadcast_to(normal, (*local.shape, 3)), flat[local]


def _from_corners(points: Floats, corner_points: Ints, normals: Floats, uvs: Floats) -> Solid:
    """A vertex per corner, all corners at one point declared the same."""
    flat = corner_points.ravel()
    count = flat.size
    first = np.full(len(points), count)
    np.minimum.at(first, flat, np.arange(count))
    target = first[flat]
    moved = target != np.arange(count)
    return Solid(
        points_mm=points[flat],
        normals=normals.reshape(-1, 3),
        uvs=uvs.reshape(-1, 2),
        faces=np.arange(count).reshape(-1, 3),
        same_from=np.flatnonzero(moved),
        same_to=target[moved],
    )
