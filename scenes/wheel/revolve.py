"""Turning an outline about the axis into a closed mesh with exact normals."""

from __future__ import annotations

import manifold3d
import numpy as np

from burrscan.arrays import Floats, Ints
from scenes.wheel.outline import Outline
from scenes.wheel.solid import Solid


def sections_for(radius_mm: float, *, chord_error_mm: float) -> int:
    """Sections that keep the chords of a circle within ``chord_error_mm``; a multiple of 4, at least 64."""
    n = np.pi / np.arccos(1.0 - chord_error_mm / radius_mm)
    return max(64, 4 * int(np.ceil(n / 4.0)))


def revolve(outline: Outline, *, sections: int, first: int = 0, count: int | None = None) -> Solid:
    """Turn the outline about the z axis, all the way or over a run of sections, whose ends stay open.

    u runs once round the circumference from 0 at angle 0, v along the outline; dp/du is the direction of the
    circumference, as a turned finish needs. Runs of one wheel meet bit for bit. O(count × segments).

    Parameters
    ----------
    outline
        S segments.
    sections
        Number of facets round the full circumference.
    first, count
        The run; all sections when ``count`` is None.

    """
    columns = _Columns(outline)
    count = sections if count is None else count
    ring = np.arange(first, first + count + 1)
    angles = 2.0 * np.pi * (ring % sections) / sections
    cos, sin = np.cos(angles)[:, None], np.sin(angles)[:, None]
    z, r = columns.points_zr.T
    nz, nr = columns.normals_zr.T
    shape = (count + 1, len(z))
    points = np.stack([cos * r, sin * r, np.broadcast_to(z, shape)], axis=-1)
    normals = np.stack([cos * nr, sin * nr, np.broadcast_to(nz, shape)], axis=-1)
    # the corner of a triangle on the axis takes the u of the triangle's middle
    u = (ring[:, None] + np.where(r == 0.0, 0.5, 0.0)) / sections
    uvs = np.stack([np.broadcast_to(u, shape), np.broadcast_to(columns.v, shape)], axis=-1)
    same_from, same_to = columns.same_points(count, closed=count == sections)
    return Solid(
        points_mm=points.reshape(-1, 3),
        normals=normals.reshape(-1, 3),
        uvs=uvs.reshape(-1, 2),
        faces=columns.faces(count),
        same_from=same_from,
        same_to=same_to,
    )


def caps(outline: Outline, *, count: int) -> Ints:
    """(C, 3) the two plane faces that close a run of ``count`` sections, of vertices of :func:`revolve`."""
    columns = _Columns(outline)
    canonical = columns.canonical()
    size = len(canonical)
    nodes = np.unique(columns.node, return_index=True)[1]
    # seen with r to the right and z up, the outline runs counter-clockwise
    plane = manifold3d.triangulate([columns.points_zr[nodes][:, ::-1]], -1.0)
    start = canonical[nodes][np.asarray(plane, np.int64)]
    end = np.where(columns.points_zr[start, 1] == 0.0, start, start + count * size)
    return np.concatenate([start, end[:, ::-1]])


class _Columns:
    """The vertices of one section: one per outline point and normal, so two at a crease."""

    def __init__(self, outline: Outline) -> None:
        smooth = outline.smooth_joint
        n = len(smooth)
        # a segment starts at a column of its own unless the joint before it is smooth
        new_start = np.concatenate([[True], ~smooth[:-1]])
        self.start: Ints = np.cumsum(new_start) + np.arange(n) - 1
        self.end: Ints = self.start + 1
        size = int(self.end[-1]) + 1
        lengths = np.linalg.norm(outline.end_zr - outline.start_zr, axis=1)
        reached = np.concatenate([[0.0], np.cumsum(lengths)])
        self.points_zr: Floats = np.empty((size, 2))
        self.normals_zr: Floats = np.empty((size, 2))
        self.v: Floats = np.empty(size)
        self.node: Ints = np.empty(size, np.int64)
        closed = bool(outline.end_zr[-1, 1] > 0.0)
        for columns, points, normals, v, nodes in (
            (self.end, outline.end_zr, outline.end_normal_zr, reached[1:], np.arange(1, n + 1)),
            (self.start, outline.start_zr, outline.start_normal_zr, reached[:-1], np.arange(n)),
        ):
            self.points_zr[columns] = points
            self.normals_zr[columns] = normals
            self.v[columns] = v / reached[-1]
            self.node[columns] = nodes % n if closed else nodes

    def faces(self, count: int) -> Ints:
        """(T, 3) two triangles per facet, one where an end lies on the axis."""
        size = len(self.v)
        here = np.arange(count)[:, None] * size
        there = here + size
        a, b = self.start[None], self.end[None]
        r_a, r_b = self.points_zr[self.start, 1], self.points_zr[self.end, 1]
        apex_b = np.where(r_b == 0.0, here + b, there + b)
        lower = np.stack([here + a, there + a, apex_b], axis=-1)[:, r_a > 0.0]
        upper = np.stack([here + a, there + b, here + b], axis=-1)[:, r_b > 0.0]
        return np.concatenate([lower.reshape(-1, 3), upper.reshape(-1, 3)])

    def canonical(self) -> Ints:
        """(columns,) the first column at the same point."""
        _, first, inverse = np.unique(self.node, return_index=True, return_inverse=True)
        return np.asarray(first[inverse], np.int64)

    def same_points(self, count: int, *, closed: bool) -> tuple[Ints, Ints]:
        """Pairs of vertices at one position: at creases, on the axis, and at the seam of a closed run."""
        size, canonical = len(self.v), self.canonical()
        ring = np.arange(count + 1)[:, None]
        target = (ring % count if closed else ring) * size + canonical
        target = np.where(self.points_zr[:, 1] == 0.0, canonical, target).ravel()
        vertices = np.arange(target.size)
        moved = target != vertices
        return vertices[moved], target[moved]
