"""Which vertices belong to another surface than the curve beside them: the back of a thin wall.

A wall is thin where its two sides are nearer to each other than deviations reach. A view that shows one side
over a short arc only leaves it without a curve of its own; its vertices then lie a wall's thickness within
the other side's curve, which is no nick. Their faces look the other way.
"""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Bools, Floats, Ints32
from burrscan.burrs.bodies import off_mm, pieces

_BACK = -0.5
"""Cosine between a vertex's normal and the curve's, below which it looks the other way: the flank of a nick
is at most upright, and noise tilts it by less than 30°."""
_WOUND = 0.8
"""Share of the vertices that look out: of less the winding of the faces says nothing."""
_ASKED = 10_000
"""Faces that are asked how they are wound, at most."""
_FEWEST = 10
"""Vertices within the surface: fewer are strays."""
_HANGING = 0.2
"""Share of a piece off the curve that looks back, from which on all of it is the other surface's: a floor
hangs on the back of its wall, upright to the curve."""


def of_another_surface(part_mm: Floats, faces: Ints32, normal: Floats, distance_mm: Floats) -> Bools:
    """(V,) True for the vertices that are no deviation from the curve beside them.

    Parameters
    ----------
    part_mm, faces
        (V, 3) in the part frame and (T, 3), wound so that they look out; of a cloud nothing is known.
    normal
        (V, 2) outward normal (z, r) of the curve at the nearest place.
    distance_mm
        (V,) distance from there, outwards positive; NaN where there is no place.

    Notes
    -----
    O(V + T). The normal of a vertex is that of its faces and of those around them, by area.

    """
    none, known = np.zeros(len(part_mm), dtype=np.bool_), np.isfinite(distance_mm)
    if not len(faces) or not known.any():
        return none
    most = off_mm(distance_mm)
    within = known & (distance_mm < -most)
    if np.count_nonzero(within) < _FEWEST or not _wound(part_mm, faces, normal, known):
        return none
    ring = np.zeros_like(within)
    ring[faces[within[faces].any(axis=1)]] = True
    back = within & (_cosines(part_mm, faces[ring[faces].any(axis=1)], normal) < _BACK)
    return _hanging(faces, known & (np.abs(distance_mm) > most), back) if back.any() else none


def _wound(part_mm: Floats, faces: Ints32, normal: Floats, known: Bools) -> bool:
    """Whether the faces, or some of them evenly chosen, look out."""
    cosine = _cosines(part_mm, faces[:: max(len(faces) // _ASKED, 1)], normal)
    told = known & np.isfinite(cosine)
    return bool(told.any() and np.mean(cosine[told] > 0.0) >= _WOUND)


def _hanging(faces: Ints32, off: Bools, back: Bools) -> Bools:
    """(V,) the pieces of a mesh off the curve of which enough looks back."""
    piece = pieces(faces, off)
    size, looking = np.bincount(piece), np.bincount(piece, weights=back)
    return np.asarray(off & (looking >= _HANGING * size)[piece])


def _cosines(vertices: Floats, faces: Ints32, normal: Floats) -> Floats:
    """Between the surface's normal at each vertex and its curve's, NaN where there is none."""
    a, b, c = (vertices[corner] for corner in faces.T)
    area = np.cross(b - a, c - a)
    own = _at_corners(faces, np.where(np.isfinite(area).all(axis=1, keepdims=True), area, 0.0), len(vertices))
    x, y, z = _at_corners(faces, own[faces].sum(axis=1), len(vertices)).T
    px, py, _ = vertices.T
    with np.errstate(invalid="ignore", divide="ignore"):
        outward = (x * px + y * py) / np.hypot(px, py)
        cosine = (z * normal[:, 0] + outward * normal[:, 1]) / np.sqrt(x * x + y * y + z * z)
    return np.asarray(cosine)


def _at_corners(faces: Ints32, values: Floats, count: int) -> Floats:
    """(V, 3) sum of the values (T, 3) of the faces that meet at each vertex."""
    corners = faces.ravel()
    return np.stack([np.bincount(corners, np.repeat(one, 3), count) for one in values.T], axis=1)
