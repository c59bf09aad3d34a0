"""A point cloud in its own canonical frame, so that pose, scale and order of the input cannot matter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Floats, Ints
from burrscan.axis.jit import kernel
from burrscan.strays import FAR, beyond

FINE_SIDE = 0.03
"""Side of a fine voxel, in units of the cloud's rms radius."""
REACH = 4.0
"""Points further than this many rms radii from the mean take no part in the voxels."""


@dataclass(frozen=True)
class Cloud:
    """Points centred on their mean, turned to their principal axes and scaled to unit rms radius.

    Parameters
    ----------
    points
        (V, 3) dimensionless.
    weights
        (V,) inverse variances with unit mean; empty where all points weigh the same.
    mean_mm, scale_mm, rotation
        ``points = (vertices_mm - mean_mm) @ rotation / scale_mm``; the rotation's columns are the principal
        axes, their senses fixed by the third moments.

    """

    points: Floats
    weights: Floats
    mean_mm: Floats
    scale_mm: float
    rotation: Floats


@kernel
def moments(vertices: Floats) -> tuple[Floats, Floats]:
    """Mean and covariance, in two passes over the data (a mean far from the origin costs no digits)."""
    n = vertices.shape[0]
    mx, my, mz = 0.0, 0.0, 0.0
    for i in range(n):
        mx += vertices[i, 0]
        my += vertices[i, 1]
        mz += vertices[i, 2]
    mx, my, mz = mx / n, my / n, mz / n
    xx, xy, xz, yy, yz, zz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(n):
        x, y, z = vertices[i, 0] - mx, vertices[i, 1] - my, vertices[i, 2] - mz
        xx += x * x
        xy += x * y
        xz += x * z
        yy += y * y
        yz += y * z
        zz += z * z
    covariance = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) / n
    return np.array([mx, my, mz]), covariance


@kernel
def _turned(vertices: Floats, mean: Floats, turn: Floats, points: Floats) -> Floats:
    """Fill ``points`` with the vertices in the principal frame; return the third moments."""
    sx, sy, sz = 0.0, 0.0, 0.0
    for i in range(vertices.shape[0]):
        a, b, c = vertices[i, 0] - mean[0], vertices[i, 1] - mean[1], vertices[i, 2] - mean[2]
        x = a * turn[0, 0] + b * turn[1, 0] + c * turn[2, 0]
        y = a * turn[0, 1] + b * turn[1, 1] + c * turn[2, 1]
        z = a * turn[0, 2] + b * turn[1, 2] + c * turn[2, 2]
        sx += x * x * x
        sy += y * y * y
        sz += z * z * z
        points[i, 0], points[i, 1], points[i, 2] = x, y, z
    return np.array([sx, sy, sz])


def canonical_cloud(vertices_mm: Floats, sigma_mm: Floats | None) -> Cloud:
    """Move a cloud to its canonical frame, in which few vertices far out have no say. O(V)."""
    far = beyond(vertices_mm, times=FAR)
    mean, covariance = moments(np.ascontiguousarray(vertices_mm[~far]) if far.any() else vertices_mm)
    scale = float(np.sqrt(np.trace(covariance)))
    turn = np.linalg.eigh(covariance / scale**2)[1][:, ::-1]
    points = np.empty_like(vertices_mm)
    skew = _turned(vertices_mm, mean, turn / scale, points)
    senses = np.where(skew < 0.0, -1.0, 1.0)
    senses[1] *= np.sign(np.linalg.det(turn * senses))  # right-handed: the middle axis gives way
    points *= senses
    if sigma_mm is None:
        weights = np.empty(0)
    else:
        weights = 1.0 / sigma_mm**2
        weights /= weights.mean()
    return Cloud(points, weights, mean, scale, turn * senses)


@kernel
def _fill(
    points: Floats, weights: Floats, side: float, reach: float, keys: Floats, rows: Floats, table: Floats
) -> int:
    """Accumulate 1, p and p pᵀ per voxel through a hash table; -1 when the table is more than half full."""
    mask = table.shape[0] - 1
    span = int(np.ceil(reach / side))
    wide = 2 * span + 1
    count = 0
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        if abs(x) >= reach or abs(y) >= reach or abs(z) >= reach:
            continue
        a = int(np.floor(x / side)) + span
        b = int(np.floor(y / side)) + span
        c = int(np.floor(z / side)) + span
        key = (a * wide + b) * wide + c
        slot = ((key * 2654435761) >> 7) & mask
        while table[slot] >= 0 and keys[table[slot]] != key:
            slot = (slot + 1) & mask
        if table[slot] < 0:
            if count >= rows.shape[0]:
                return -1
            table[slot] = count
            keys[count] = key
            rows[count] = 0.0
            count += 1
        row = rows[table[slot]]
        w = weights[i] if weights.shape[0] > 0 else 1.0
        row[0] += w
        row[1] += w * x
        row[2] += w * y
        row[3] += w * z
        row[4] += w * x * x
        row[5] += w * x * y
        row[6] += w * x * z
        row[7] += w * y * y
        row[8] += w * y * z
        row[9] += w * z * z
    return count


def voxel_moments(points: Floats, weights: Floats, side: float = FINE_SIDE) -> tuple[Ints, Floats]:
    """Weighted moments of the points in each voxel.

    Returns
    -------
    (M, 3) integer cell of each voxel, and (M, 10) sums of 1, x, y, z, xx, xy, xz, yy, yz, zz. O(V).

    """
    capacity = 1 << 15
    while True:
        keys = np.empty(capacity // 2, dtype=np.int64)
        rows = np.empty((capacity // 2, 10))
        table = np.full(capacity, -1, dtype=np.int32)
        count = _fill(points, weights, side, REACH, keys, rows, table)
        if count >= 0:
            break
        capacity *= 4
    wide = 2 * int(np.ceil(REACH / side)) + 1
    keys = keys[:count]
    cells = np.stack([keys // (wide * wide), keys // wide % wide, keys % wide], axis=1)
    return cells, rows[:count]
