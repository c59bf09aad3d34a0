"""Faces that look sideways: walls of lugs, flutes, teeth and spokes are no part of a surface of revolution.

A normal of a surface of revolution meets its axis (Pottmann & Randrup). Those of walls do not, and one view
shows the walls on one side of the lugs only: the few of their points that come near the generatrix draw the
axis across.
"""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Bools, Floats, Ints32
from burrscan.axis.jit import kernel

ASIDE = 0.3
"""Sine of the angle between a normal and its meridian beyond which a face is a wall: no noise, 17°."""
SURE = 4.0
"""Standard deviations of a normal beyond that, so that noise alone leaves no point out."""
RINGS = 3
"""Neighbours left out with a wall: smoothing has mixed it into them."""


@kernel
def _mark(points: Floats, faces: Ints32, direction: Floats, place: Floats, limit: float, kept: Bools) -> None:
    """Mark the corners of walls; ``limit`` is the square of the sine."""
    a0, a1, a2 = direction
    for f in range(faces.shape[0]):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        ux, uy, uz = points[j, 0] - x, points[j, 1] - y, points[j, 2] - z
        vx, vy, vz = points[k, 0] - x, points[k, 1] - y, points[k, 2] - z
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        x, y, z = (
            x + (ux + vx) / 3.0 - place[0],
            y + (uy + vy) / 3.0 - place[1],
            z + (uz + vz) / 3.0 - place[2],
        )
        mx, my, mz = a1 * z - a2 * y, a2 * x - a0 * z, a0 * y - a1 * x
        across = nx * mx + ny * my + nz * mz
        if across * across > limit * (nx * nx + ny * ny + nz * nz) * (mx * mx + my * my + mz * mz):
            kept[i] = kept[j] = kept[k] = False


@kernel
def _mark_neighbours(faces: Ints32, marked: Bools, kept: Bools) -> None:
    for f in range(faces.shape[0]):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        if not (marked[i] and marked[j] and marked[k]):
            kept[i] = kept[j] = kept[k] = False


def off_walls(points: Floats, faces: Ints32, direction: Floats, place: Floats, *, noise: float) -> Bools:
    """(V,) which points are neither on a wall nor beside one. O(T).

    Parameters
    ----------
    points, faces
        (V, 3) smoothed, and (T, 3).
    direction, place
        The axis, to a few degrees.
    noise
        Standard deviation of the faces' normals, radians.

    """
    kept = np.ones(len(points), np.bool_)
    limit = ASIDE + SURE * noise
    if limit >= 1.0:
        return kept
    _mark(points, faces, direction, place, limit * limit, kept)
    for _ in range(0 if kept.all() else RINGS):
        _mark_neighbours(faces, kept.copy(), kept)
    return kept
