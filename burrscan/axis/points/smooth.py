"""Noise reduction along a dense mesh before anything reads positions as shape.

At a noise of 1 mm on a grid of 0.5 mm every face normal is noise. Averages over neighbours keep what an axis
is found from: they treat every meridian alike, so they blur the generatrix but do not tilt the axis.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial import cKDTree

from burrscan.arrays import Floats, Ints32
from burrscan.axis.jit import kernel
from burrscan.robust import MEDIAN_SIZE

EDGE_LIMIT = 3.0
"""Edges longer than this many median edges join different surfaces, or an outlier, and carry nothing."""


@kernel
def _bin_of(square: float) -> int:
    """One of 2048 bins, 32 to each power of two: a histogram that needs no range and no order.

    The exponent and the first five bits of the mantissa, as they stand in an IEEE 754 double.
    """
    bits = int(np.float64(square).view(np.int64))
    return min(2047, max(0, (bits >> 47) - 982 * 32))


@kernel
def _middle_of(index: int) -> float:
    """The middle of a bin."""
    return math.ldexp(0.5 + (index % 32 + 0.5) / 64.0, index // 32 - 40)


@kernel
def median_square_edge(points: Floats, faces: Ints32) -> float:
    """Median squared length of the faces' longest edges, from a histogram over logarithms (order-free)."""
    bins = np.zeros(2048)
    for f in range(faces.shape[0]):
        square = 0.0
        for s in range(3):
            a, b = faces[f, s], faces[f, (s + 1) % 3]
            x, y, z = points[a, 0] - points[b, 0], points[a, 1] - points[b, 1], points[a, 2] - points[b, 2]
            square = max(square, x * x + y * y + z * z)
        if square > 0.0:
            bins[_bin_of(square)] += 1.0
    half, total = 0.5 * bins.sum(), 0.0
    for k in range(2048):
        total += bins[k]
        if total >= half:
            return float(_middle_of(k))
    return 0.0


@kernel
def _round(points: Floats, weights: Floats, faces: Ints32, limit: float, out: Floats) -> None:
    """One round: each vertex to the mean of the middles of its faces; faces with a long edge do not count."""
    count = np.zeros(points.shape[0])
    out[:] = 0.0
    for f in range(faces.shape[0]):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        ax, ay, az = points[a, 0], points[a, 1], points[a, 2]
        bx, by, bz = points[b, 0], points[b, 1], points[b, 2]
        cx, cy, cz = points[c, 0], points[c, 1], points[c, 2]
        ab = (ax - bx) ** 2 + (ay - by) ** 2 + (az - bz) ** 2
        bc = (bx - cx) ** 2 + (by - cy) ** 2 + (bz - cz) ** 2
        ca = (cx - ax) ** 2 + (cy - ay) ** 2 + (cz - az) ** 2
        if max(ab, bc, ca) < limit:
            u, v, w = 1.0, 1.0, 1.0
            if weights.shape[0] > 0:
                u, v, w = weights[a], weights[b], weights[c]
            x, y, z = u * ax + v * bx + w * cx, u * ay + v * by + w * cy, u * az + v * bz + w * cz
            for e in (a, b, c):
                out[e, 0] += x
                out[e, 1] += y
                out[e, 2] += z
                count[e] += u + v + w
    for i in range(points.shape[0]):
        if count[i] > 0.0:
            share = 1.0 / count[i]
            for e in range(3):
                out[i, e] *= share
        else:
            for e in range(3):
                out[i, e] = points[i, e]


def smoothed(points: Floats, weights: Floats, faces: Ints32, *, rounds: int) -> Floats:
    """Average each vertex over its faces, by weight if there are any, ``rounds`` times. O(rounds · T)."""
    limit = EDGE_LIMIT**2 * median_square_edge(points, faces)
    for _ in range(rounds):
        out = np.empty_like(points)
        _round(points, weights, faces, limit, out)
        points = out
    return points


def given_back(once: Floats, weights: Floats, faces: Ints32, *, rounds: int) -> Floats:
    """Smoothed points, with what smoothing again takes off given back (twicing, Tukey 1977). O(rounds · T).

    Averages lie within a curve, and the further, the more aslant it is seen, since neighbours are further
    apart there: that tilts and shifts axes.
    """
    return _twiced(once, smoothed(once, weights, faces, rounds=rounds)) if rounds else once


@kernel
def _twiced(once: Floats, twice: Floats) -> Floats:
    """Points averaged once, and what averaging them again takes off given back."""
    for i in range(once.shape[0]):
        for e in range(3):
            twice[i, e] = 2.0 * once[i, e] - twice[i, e]
    return twice


@kernel
def displacement(raw: Floats, smooth: Floats) -> float:
    """Noise of the raw points, from the median distance that smoothing moved them (along the normal)."""
    bins = np.zeros(2048)
    for i in range(raw.shape[0]):
        x, y, z = raw[i, 0] - smooth[i, 0], raw[i, 1] - smooth[i, 1], raw[i, 2] - smooth[i, 2]
        square = x * x + y * y + z * z
        if square > 0.0:
            bins[_bin_of(square)] += 1.0
    half, total = 0.5 * bins.sum(), 0.0
    for k in range(2048):
        total += bins[k]
        if total >= half > 0.0:
            return float(np.sqrt(_middle_of(k)) / MEDIAN_SIZE)
    return 0.0


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
