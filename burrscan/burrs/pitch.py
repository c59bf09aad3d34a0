"""How far apart the vertices of a mesh lie, along the curve and around: farther where a surface is grazed."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats, Ints, Ints32
from burrscan.turns import turn_rad


def pitches_mm(
    along_mm: Floats, angle: Floats, radius_mm: Floats, faces: Ints32, vertex: Ints, *, count: int
) -> Floats:
    """(N, 2) how far the triangles at some vertices reach along the curve and around, mm, in the mean.

    That is the distance between rows and between columns where vertices lie in such. NaN where a vertex has
    no triangle whose corners are all among them. O(T).

    Parameters
    ----------
    along_mm, angle, radius_mm
        (N,) places on the unrolled surface; angles in radians, turns of any number.
    faces
        (T, 3) triangles.
    vertex
        (N,) index of each place in the mesh.
    count
        Of the mesh's vertices.

    """
    place = np.full(count, -1)
    place[vertex] = np.arange(len(vertex))
    corner = place[faces]
    corner = corner[(corner >= 0).all(axis=1)]
    turn = turn_rad(angle[corner] - angle[corner[:, :1]])
    reach = np.ptp(along_mm[corner], axis=1), np.ptp(turn, axis=1) * radius_mm[corner[:, 0]]
    every = corner.ravel()
    sums = [np.bincount(every, np.repeat(one, 3), len(vertex)) for one in reach]
    number = np.bincount(every, minlength=len(vertex))
    return np.stack(sums, axis=1) / np.where(number, number, np.nan)[:, None]
