"""Noise reduction along a dense mesh before anything reads positions as shape.

At a noise of 1 mm on a grid of 0.5 mm every face normal is noise. Averages over neighbours keep what an axis is
found from: they treat every meridian alike, so they blur the generatrix but do not tilt the axis.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from burrscan.arrays import Floats, Ints32

EDGE_LIMIT = 4.0
"""Edges longer than this many median edges join different surfaces, or an outlier, and carry nothing."""


@njit(cache=True, nogil=True)
def _median_square_edge(points: Floats, faces: Ints32) -> float:  # pragma: no cover
    """Median squared length of the faces' first edges, from a histogram over logarithms (order-free)."""
    bins = np.zeros(2048)
    for f in range(faces.shape[0]):
        a, b = faces[f, 0], faces[f, 1]
        x, y, z = points[a, 0] - points[b, 0], points[a, 1] - points[b, 1], points[a, 2] - points[b, 2]
        square = x * x + y * y + z * z
        if square > 0.0:
            bins[min(2047, max(0, int(1024 + 32 * np.log2(square))))] += 1.0
    half, total = 0.5 * bins.sum(), 0.0
    for k in range(2048):
        total += bins[k]
        if total >= half:
            return float(2.0 ** ((k + 0.5 - 1024) / 32))
    return 0.0


@njit(cache=True, nogil=True)
def _round(points: Floats, faces: Ints32, limit: float, out: Floats) -> None:  # pragma: no cover
    """One round: each vertex to the mean of itself (weight 4) and its neighbours (once per shared face)."""
    count = np.full(points.shape[0], 4.0)
    for i in range(points.shape[0]):
        for e in range(3):
            out[i, e] = 4.0 * points[i, e]
    for f in range(faces.shape[0]):
        for s in range(3):
            a, b = faces[f, s], faces[f, (s + 1) % 3]
            x, y, z = points[a, 0] - points[b, 0], points[a, 1] - points[b, 1], points[a, 2] - points[b, 2]
            if x * x + y * y + z * z < limit:
                out[a, 0] += points[b, 0]
                out[a, 1] += points[b, 1]
                out[a, 2] += points[b, 2]
                out[b, 0] += points[a, 0]
                out[b, 1] += points[a, 1]
                out[b, 2] += points[a, 2]
                count[a] += 1.0
                count[b] += 1.0
    for i in range(points.shape[0]):
        for e in range(3):
            out[i, e] /= count[i]


def smoothed(points: Floats, faces: Ints32, *, rounds: int) -> Floats:
    """Average each vertex with its neighbours, ``rounds`` times. O(rounds · T)."""
    limit = EDGE_LIMIT**2 * _median_square_edge(points, faces)
    for _ in range(rounds):
        out = np.empty_like(points)
        _round(points, faces, limit, out)
        points = out
    return points


@njit(cache=True, nogil=True)
def displacement(raw: Floats, smooth: Floats) -> float:  # pragma: no cover
    """Noise of the raw points, from the median distance that smoothing moved them (mostly along the normal)."""
    bins = np.zeros(2048)
    for i in range(raw.shape[0]):
        x, y, z = raw[i, 0] - smooth[i, 0], raw[i, 1] - smooth[i, 1], raw[i, 2] - smooth[i, 2]
        square = x * x + y * y + z * z
        if square > 0.0:
            bins[min(2047, max(0, int(1024 + 32 * np.log2(square))))] += 1.0
    half, total = 0.5 * bins.sum(), 0.0
    for k in range(2048):
        total += bins[k]
        if total >= half > 0.0:
            return float(2.0 ** ((k + 0.5 - 1024) / 64) / 0.6745)
    return 0.0
