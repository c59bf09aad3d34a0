"""Noise reduction along a dense mesh before anything reads positions as shape.

At a noise of 1 mm on a grid of 0.5 mm every face normal is noise. Averages over neighbours keep what an axis
is found from: they treat every meridian alike, so they blur the generatrix but do not tilt the axis.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from burrscan.arrays import Floats, Ints32
from burrscan.axis.jit import kernel
from burrscan.robust import MEDIAN_SIZE

EDGE_LIMIT = 3.0
"""Edges longer than this many median edges join different surfaces, or an outlier, and carry nothing."""


def median_square_edge(points: Floats, faces: Ints32) -> float:
    """Median squared length of the faces' longest edges. O(T)."""
    return _median_beyond_0(_longest(points, faces))


def _median_beyond_0(values: Floats) -> float:
    """Median of those above 0, 0 where none is."""
    return float(np.median(values[values > 0.0])) if values.any() else 0.0


@kernel
def _longest(points: Floats, faces: Ints32) -> Floats:
    """(T,) squared length of each face's longest edge."""
    longest = np.zeros(len(faces))
    for f in range(len(faces)):
        for s in range(3):
            a, b = faces[f, s], faces[f, (s + 1) % 3]
            x, y, z = points[a, 0] - points[b, 0], points[a, 1] - points[b, 1], points[a, 2] - points[b, 2]
            longest[f] = max(longest[f], x * x + y * y + z * z)
    return longest


def smoothed(points: Floats, weights: Floats, faces: Ints32, *, rounds: int) -> Floats:
    """Average each vertex over its faces, by weight if there are any, ``rounds`` times. O(rounds · T)."""
    limit = EDGE_LIMIT**2 * median_square_edge(points, faces)
    for _ in range(rounds):
        points = _round(points, weights, faces[_longest(points, faces) < limit])
    return points


def _round(points: Floats, weights: Floats, faces: Ints32) -> Floats:
    """One round: each vertex to the mean of the middles of its faces."""
    ends = np.arange(0, faces.size + 1, 3)
    corners = csr_array((np.ones(faces.size), faces.ravel(), ends), shape=(len(faces), len(points)))
    weights = weights[:, None] if len(weights) else np.ones((len(points), 1))
    total: Floats = np.asarray(corners.T @ (corners @ np.hstack([weights, weights * points])))
    known = total[:, :1] > 0.0
    return np.where(known, total[:, 1:] / np.where(known, total[:, :1], 1.0), points)


def given_back(once: Floats, weights: Floats, faces: Ints32, *, rounds: int) -> Floats:
    """Smoothed points, with what smoothing again takes off given back (twicing, Tukey 1977). O(rounds · T).

    Averages lie within a curve, and the further, the more aslant it is seen, since neighbours are further
    apart there: that tilts and shifts axes.
    """
    return 2.0 * once - smoothed(once, weights, faces, rounds=rounds) if rounds else once


def displacement(raw: Floats, smooth: Floats) -> float:
    """Noise of the raw points, from the median distance that smoothing moved them (along the normal)."""
    return _median_beyond_0(np.linalg.norm(raw - smooth, axis=1)) / MEDIAN_SIZE


def smoothed_cloud(points: Floats, *, rounds: int, neighbours: int = 8) -> Floats:
    """The same for points without faces: the mean over the nearest neighbours. O(V log V)."""
    tree = cKDTree(points)
    for _ in range(rounds):
        found = tree.query(points, k=min(neighbours, len(points)))
        distance, index = np.asarray(found[0]), np.asarray(found[1])
        limit = EDGE_LIMIT * float(np.median(distance[:, -1]))
        near = np.asarray(distance < max(limit, 1e-300))
        near[:, 0] = True
        points = np.einsum("nk,nki->ni", near, points[index]) / near.sum(axis=1)[:, None]
        tree = cKDTree(points)
    return points
