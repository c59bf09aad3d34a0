"""Faces that look sideways: walls of lugs, flutes, teeth and spokes are no part of a surface of revolution.

A normal of a surface of revolution meets its axis (Pottmann & Randrup). Those of walls do not, and one view
shows the walls on one side of the lugs only: the few of their points that come near the generatrix draw the
axis across.
"""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Bools, Floats, Ints32

ASIDE = 0.3
"""Sine of the angle between a normal and its meridian beyond which a face is a wall: no noise, 17°."""
SURE = 4.0
"""Standard deviations of a normal beyond that, so that noise alone leaves no point out."""
RINGS = 3
"""Neighbours left out with a wall: smoothing has mixed it into them."""


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
    a, b, c = (points[corner] for corner in faces.T)
    normal, lever = np.cross(b - a, c - a), np.cross(direction, (a + b + c) / 3.0 - place)
    across = np.abs((normal * lever).sum(axis=1))
    wall = across > limit * np.linalg.norm(normal, axis=1) * np.linalg.norm(lever, axis=1)
    for _ in range(RINGS + 1 if wall.any() else 0):
        kept[faces[wall]] = False
        wall = ~kept[faces].all(axis=1)
    return kept
