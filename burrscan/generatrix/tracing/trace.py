"""From occupied cells to ordered pieces of curve, by walking along them."""

from __future__ import annotations

import numpy as np
from numba import njit

from burrscan.arrays import Bools, Floats, Ints, Ints32
from burrscan.generatrix.tracing.cells import Cells, opposed

REACH = 2.3
"""A step of the walk, cells at most: longer than an edge left unsampled, shorter than a gap worth keeping."""
SHARPEST = -0.2
"""Cosine of the sharpest turn of a walk, and so of a corner: 100 degrees."""
_LATERAL = 0.8
"""Cells this near (in cells) to the path are the same piece of surface."""


def trace(cells: Cells, *, side_mm: float) -> list[Floats]:
    """Ordered pieces, each (K, 2) points (z, r), through cells' centres; a closed one ends where it began.

    O(cells).
    """
    # By number of data, which no rotation changes.
    order = np.argsort(-cells.count, kind="stable")
    visited = np.zeros(len(order), dtype=np.bool_)
    pieces = []
    for start in order:
        if visited[start]:
            continue
        path = _both_ways(
            cells.centre_mm, cells.place, cells.index, cells.facing, visited, int(start), side_mm
        )
        points = cells.centre_mm[path]
        if _length(points) > 3.0 * side_mm:
            pieces.append(_closed(points, side_mm))
    return pieces


def _length(points: Floats) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def _closed(points: Floats, side: float) -> Floats:
    """Join the ends where the walk came back to its start."""
    long = _length(points) > 8.0 * side
    if long and np.linalg.norm(points[0] - points[-1]) < REACH * side:
        return np.concatenate([points, points[:1]])
    return points


def _both_ways(
    centre: Floats, place: Ints, index: Ints32, facing: Floats, visited: Bools, start: int, side: float
) -> Ints:
    direction = _tangent(centre, place, index, start)
    ahead = _walk(centre, place, index, facing, visited, start, direction, side)
    back = _walk(centre, place, index, facing, visited, start, -direction, side)
    return np.concatenate([back[:0:-1], ahead])


@njit(cache=True, nogil=True, error_model="numpy")
def _tangent(centre: Floats, place: Ints, index: Ints32, i: int) -> Floats:
    """Direction of the curve at a cell, from the cells around it."""
    zz = rr = zr = 0.0
    for row in range(max(place[i, 0] - 2, 0), min(place[i, 0] + 3, index.shape[0])):
        for column in range(max(place[i, 1] - 2, 0), min(place[i, 1] + 3, index.shape[1])):
            j = index[row, column]
            if j >= 0:
                dz, dr = centre[j, 0] - centre[i, 0], centre[j, 1] - centre[i, 1]
                zz, rr, zr = zz + dz * dz, rr + dr * dr, zr + dz * dr
    turn = 0.5 * np.arctan2(2.0 * zr, zz - rr)
    return np.array([np.cos(turn), np.sin(turn)])


@njit(cache=True, nogil=True, error_model="numpy")
def _walk(
    centre: Floats,
    place: Ints,
    index: Ints32,
    facing: Floats,
    visited: Bools,
    start: int,
    direction: Floats,
    side: float,
) -> Ints:
    path = [start]
    visited[start] = True
    z, r = direction[0], direction[1]
    i = start
    while True:
        j = _next(centre, place, index, facing, visited, i, z, r, side)
        if j < 0:
            return np.array(path)
        dz, dr = centre[j, 0] - centre[i, 0], centre[j, 1] - centre[i, 1]
        length = np.sqrt(dz * dz + dr * dr) + 1e-300
        z, r = 0.5 * z + dz / length, 0.5 * r + dr / length
        norm = np.sqrt(z * z + r * r) + 1e-300
        z, r = z / norm, r / norm
        _claim(centre, place, index, facing, visited, i, j, side)
        path.append(j)
        i = j


@njit(cache=True, nogil=True, error_model="numpy")
def _next(
    centre: Floats,
    place: Ints,
    index: Ints32,
    facing: Floats,
    visited: Bools,
    i: int,
    z: float,
    r: float,
    side: float,
) -> int:
    """The nearest cell ahead, on this side of the wall, that is not yet visited.

    Turns of up to 100 degrees are possible, but dear.
    """
    best, least = -1, np.inf
    for row in range(max(place[i, 0] - 3, 0), min(place[i, 0] + 4, index.shape[0])):
        for column in range(max(place[i, 1] - 3, 0), min(place[i, 1] + 4, index.shape[1])):
            j = index[row, column]
            if j < 0 or visited[j]:
                continue
            dz, dr = centre[j, 0] - centre[i, 0], centre[j, 1] - centre[i, 1]
            length = np.sqrt(dz * dz + dr * dr) + 1e-300
            cosine = (dz * z + dr * r) / length
            if length > REACH * side or cosine < SHARPEST or opposed(facing, i, j):
                continue
            cost = length * (1.0 + 1.5 * (1.0 - cosine))
            if cost < least:
                best, least = j, cost
    return best


@njit(cache=True, nogil=True, error_model="numpy")
def _claim(
    centre: Floats, place: Ints, index: Ints32, facing: Floats, visited: Bools, i: int, j: int, side: float
) -> None:
    """Mark the cells beside the step from i to j as visited, but for those of the wall's other side."""
    dz, dr = centre[j, 0] - centre[i, 0], centre[j, 1] - centre[i, 1]
    square = dz * dz + dr * dr + 1e-300
    for row in range(max(place[i, 0] - 3, 0), min(place[i, 0] + 4, index.shape[0])):
        for column in range(max(place[i, 1] - 3, 0), min(place[i, 1] + 4, index.shape[1])):
            k = index[row, column]
            if k < 0 or visited[k] or opposed(facing, i, k):
                continue
            z, r = centre[k, 0] - centre[i, 0], centre[k, 1] - centre[i, 1]
            t = min(max((z * dz + r * dr) / square, 0.0), 1.0)
            if (z - t * dz) ** 2 + (r - t * dr) ** 2 < (_LATERAL * side) ** 2:
                visited[k] = True
    visited[j] = True
