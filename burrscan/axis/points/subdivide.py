"""Points on the faces of a coarse mesh, as drawings have them: few rings of vertices, long faces between.

Rings alone say nothing of the surface that joins them; two of them lie on a sphere.
"""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Bools, Floats, Ints, Ints32

COARSE = 0.1
"""A mesh is coarse if half of its area is in faces with an edge longer than this, in rms radii."""
TARGET = 0.04
"""Length down to which edges are halved."""
MOST_VERTICES = 50_000
"""A mesh with more is not looked at."""
MOST_FACES = 1_000_000
"""Bounds memory and time on a drawing of very unlike facets; those not yet halved then stay long."""


def subdivided(points: Floats, faces: Ints32) -> tuple[Floats, Ints32]:
    """Halve the longest edges of a coarse mesh's faces until all are short; any other mesh stays as it is.

    Parameters
    ----------
    points, faces
        (V, 3) in the canonical frame (unit rms radius) and (T, 3).

    Returns
    -------
    (V', 3) points of which the first V are those given, and (T', 3) faces. O(T').

    """
    if len(points) > MOST_VERTICES or not is_coarse(points, faces):
        return points, faces
    done = [np.empty((0, 3), np.int32)]
    while len(faces):
        edges = _edge_lengths(points, faces)
        longest = edges.argmax(axis=1)
        short = edges.max(axis=1) <= TARGET
        done.append(faces[short])
        if sum(map(len, done)) + 2 * len(faces) > MOST_FACES:
            done.append(faces[~short])
            break
        points, faces = _halved(points, faces[~short], longest[~short])
    return points, np.concatenate(done)


def is_coarse(points: Floats, faces: Ints32) -> bool:
    """Whether most of a mesh's area is in long faces, as in a drawing; (V, 3) in units of the rms radius."""
    # A scan's spikes have long faces too. The median of neighbours takes them away, but no drawing's faces.
    return _coarse(points, faces) and _coarse(_without_spikes(points, faces), faces)


def _coarse(points: Floats, faces: Ints32) -> bool:
    a, b, c = (points[faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return bool(area[_long(points, faces)].sum() > 0.5 * area.sum())


def _long(points: Floats, faces: Ints32) -> Bools:
    """(T,) faces with a long edge."""
    return np.asarray(_edge_lengths(points, faces).max(axis=1) > COARSE)


def _without_spikes(points: Floats, faces: Ints32) -> Floats:
    """Corners of long faces at the median, by coordinate, of themselves and their neighbours.

    Half of the neighbours would have to be spikes too. O(E log E) in the edges at such corners.
    """
    corners = np.unique(faces[_long(points, faces)])
    ends = np.concatenate([faces[:, [k, (k + 1) % 3]] for k in range(3)])
    ends = np.concatenate([ends, ends[:, ::-1], np.column_stack([corners, corners])])
    asked = np.zeros(len(points), np.bool_)
    asked[corners] = True
    pairs = np.unique(ends[asked[ends[:, 0]]], axis=0)
    count = np.bincount(pairs[:, 0], minlength=len(points))[corners]
    middle = np.cumsum(count) - count + count // 2
    calm = points.copy()
    for axis in range(3):
        values = points[pairs[:, 1], axis]
        calm[corners, axis] = values[np.lexsort((values, pairs[:, 0]))][middle]
    return calm


def _edge_lengths(points: Floats, faces: Ints32) -> Floats:
    """(T, 3) lengths of the edges from corner k to the next."""
    edges = (points[faces[:, k]] - points[faces[:, (k + 1) % 3]] for k in range(3))
    return np.asarray(np.sqrt(np.stack([np.einsum("ti,ti->t", edge, edge) for edge in edges], axis=1)))


def _halved(points: Floats, faces: Ints32, longest: Ints) -> tuple[Floats, Ints32]:
    """Cut every face through the middle of its longest edge; two faces at an edge share the middle."""
    each = np.arange(len(faces))
    start, end, tip = (faces[each, (longest + k) % 3] for k in range(3))
    keys = np.minimum(start, end).astype(np.int64) * len(points) + np.maximum(start, end)
    _, first, number = np.unique(keys, return_index=True, return_inverse=True)
    middle = (len(points) + number).astype(np.int32)
    points = np.concatenate([points, 0.5 * (points[start[first]] + points[end[first]])])
    halves = np.concatenate([np.stack([start, middle, tip], 1), np.stack([middle, end, tip], 1)])
    return points, halves.astype(np.int32)
