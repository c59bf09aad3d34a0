"""Which vertices belong to a body that stands on the surface of revolution: a bar, a handle, a fixture.

Burrs of machining are tenths of a millimetre to a few millimetres high, whatever the size of the part. What
runs on further is none, and neither is its foot, the only bit of it that is near enough to be taken for one.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from burrscan.arrays import Bools, Floats, Ints32
from burrscan.generatrix.deviation import REACH
from burrscan.robust import SIGMA_PER_MEDIAN

TALLEST_MM, TALLEST = 5.0, 0.05
"""What runs on further from the curve, and further than that share of the largest radius, is no burr. The
share keeps burrs on meshes in finer units than millimetres; with a tenth the sides of flat bars were called,
of which no vertex is so far from their faces. In a scan light that bounced may lie as deep, and what it
bounced from is a burr: there it is as far as deviations are told."""
_OFF = 4.0
"""Within this many standard deviations a vertex is on its curve, whatever it belongs to."""
_FEWEST = 10
"""Vertices of a piece that far off: fewer are strays, which hang on burrs too."""


def tallest(tallest_mm: float, radius_mm: float, *, scanned: bool) -> float:
    """How high a burr is at most, mm, on a part of that largest radius, in a scan or in a mesh."""
    return max(tallest_mm, (REACH if scanned else TALLEST) * radius_mm)


def of_another_body(faces: Ints32, distance_mm: Floats, beyond: Bools) -> Bools:
    """(V,) True for the vertices of the pieces off the curve that run on beyond what a burr reaches.

    Parameters
    ----------
    faces
        (T, 3) the mesh; a cloud has no pieces.
    distance_mm
        (V,) distance from the curve, outwards positive; NaN where there is no place.
    beyond
        (V,) True for the vertices further from every curve than that.

    Notes
    -----
    O(V + T).

    """
    known = np.isfinite(distance_mm)
    if np.count_nonzero(beyond) < _FEWEST or not len(faces) or not known.any():
        return np.zeros(len(distance_mm), dtype=np.bool_)
    off = ~(np.abs(distance_mm) <= off_mm(distance_mm))
    piece = pieces(faces, off)
    return np.asarray(off & (np.bincount(piece, weights=beyond) >= _FEWEST)[piece])


def off_mm(distance_mm: Floats) -> float:
    """Beyond this distance a vertex is off its curve."""
    return _OFF * SIGMA_PER_MEDIAN * float(np.nanmedian(np.abs(distance_mm)))


def pieces(faces: Ints32, chosen: Bools) -> Ints32:
    """(V,) number of the piece of the mesh that each vertex is in when only the chosen ones are left."""
    inside = faces[chosen[faces].all(axis=1)]
    ends = inside[:, [0, 0]].ravel(), inside[:, [1, 2]].ravel()
    links = coo_array((np.ones(len(ends[0])), ends), shape=(len(chosen), len(chosen)))
    return np.asarray(connected_components(links, directed=False)[1])
