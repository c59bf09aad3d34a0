"""Small planar patches of a cloud, each with a normal: what the starts are found from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Floats, Ints
from burrscan.axis.jit import kernel

COARSE = 3
"""A surfel's voxel is this many fine voxels wide."""


@dataclass(frozen=True)
class Surfels:
    """(M, 3) mean positions, (M, 3) unit normals of unknown sense, (M,) weights."""

    points: Floats
    normals: Floats
    weights: Floats


@kernel
def _coarse_sums(cells: Ints, rows: Floats, index: Ints, side: int) -> Floats:
    sums = np.zeros((cells.shape[0], 10))
    count = 0
    for i in range(cells.shape[0]):
        a, b, c = cells[i, 0] // side + 1, cells[i, 1] // side + 1, cells[i, 2] // side + 1
        if index[a, b, c] < 0:
            index[a, b, c] = count
            count += 1
        m = index[a, b, c]
        for k in range(10):
            sums[m, k] += rows[i, k]
    return sums[:count]


@kernel
def plane_of(row: Floats) -> tuple[float, float, float, float]:
    """Unit normal of the plane through points with the given moments, and how far from planar they are.

    The latter is the smallest over the middle eigenvalue of the covariance, 1 where there is no plane. Closed
    form: eigenvalues by the cosine formula, the normal as the largest cross product of rows of C - λI.
    """
    n = row[0]
    mx, my, mz = row[1] / n, row[2] / n, row[3] / n
    xx, xy, xz = row[4] / n - mx * mx, row[5] / n - mx * my, row[6] / n - mx * mz
    yy, yz, zz = row[7] / n - my * my, row[8] / n - my * mz, row[9] / n - mz * mz
    mean = (xx + yy + zz) / 3.0
    a, b, c = xx - mean, yy - mean, zz - mean
    half = (a * a + b * b + c * c + 2.0 * (xy * xy + xz * xz + yz * yz)) / 6.0
    if half <= 0.0:
        return 0.0, 0.0, 1.0, 1.0
    size = np.sqrt(half)
    det = (a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz)) / (2.0 * size**3)
    angle = np.arccos(min(1.0, max(-1.0, det))) / 3.0
    largest = mean + 2.0 * size * np.cos(angle)
    least = mean + 2.0 * size * np.cos(angle + 2.0 * np.pi / 3.0)
    middle = 3.0 * mean - largest - least
    if not (middle > 0.0 and middle >= 1e-3 * largest):  # rounding of points that are one, or in line
        return 0.0, 0.0, 1.0, 1.0
    p, q, s = xx - least, yy - least, zz - least
    best, nx, ny, nz = 0.0, 0.0, 0.0, 1.0
    for k in range(3):
        if k == 0:
            u, v, w = xy * yz - xz * q, xz * xy - p * yz, p * q - xy * xy
        elif k == 1:
            u, v, w = xy * s - xz * yz, xz * xz - p * s, p * yz - xy * xz
        else:
            u, v, w = q * s - yz * yz, yz * xz - xy * s, xy * yz - q * xz
        length = u * u + v * v + w * w
        if length > best:
            best, nx, ny, nz = length, u, v, w
    if best == 0.0:
        return 0.0, 0.0, 1.0, 1.0
    root = np.sqrt(best)
    return nx / root, ny / root, nz / root, max(least, 0.0) / middle


@kernel
def _add_around(index: Ints, sums: Floats, wide: Floats) -> None:
    """The sums (10,) of a block of cells together; a cell without points has the index -1."""
    wide[:] = 0.0
    for s in index.flat:
        if s >= 0:
            for e in range(10):
                wide[e] += sums[s, e]


@kernel
def _fit_planes(places: Ints, index: Ints, sums: Floats, few: float) -> tuple[Floats, Floats]:
    normals = np.empty((sums.shape[0], 3))
    flatness = np.empty(sums.shape[0])
    wide = np.empty(10)
    for m in range(sums.shape[0]):
        x, y, z, flat = plane_of(sums[m])
        if sums[m, 0] < few:
            flat = 1.0
        a, b, c = places[m]
        _add_around(index[a - 1 : a + 2, b - 1 : b + 2, c - 1 : c + 2], sums, wide)
        u, v, w, blunt = plane_of(wide)
        if blunt <= flat:
            x, y, z, flat = u, v, w, blunt
        normals[m, 0], normals[m, 1], normals[m, 2] = x, y, z
        flatness[m] = flat
    return normals, flatness


def surfels_of(cells: Ints, rows: Floats) -> Surfels:
    """Planar patches from the fine voxels' moments, in the order of their voxels.

    Each voxel takes its normal from itself or from its 3×3×3 neighbourhood, whichever is flatter: the first
    where the surface is sharp, the second where the noise is large.
    """
    extent = cells.max(axis=0) // COARSE + 3
    index = np.full(extent, -1, dtype=np.int32)
    sums = _coarse_sums(cells, rows, index, COARSE)
    places = np.argwhere(index >= 0)
    sums = sums[index[index >= 0]]
    index[index >= 0] = np.arange(len(places))
    typical = float((sums[:, 0] ** 2).sum() / sums[:, 0].sum())
    normals, flatness = _fit_planes(places, index, sums, 0.1 * typical)
    weights = np.minimum(sums[:, 0], typical) / (flatness + 0.01)
    weights[flatness > 0.5] = 0.0
    return Surfels(sums[:, 1:4] / sums[:, :1], normals, weights / max(float(weights.sum()), 1e-300))
