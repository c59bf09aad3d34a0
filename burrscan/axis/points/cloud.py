"""A point cloud in its own canonical frame, so that pose, scale and order of the input cannot matter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Floats, Ints
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


def moments(vertices: Floats) -> tuple[Floats, Floats]:
    """Mean and covariance, in two passes over the data (a mean far from the origin costs no digits)."""
    mean = vertices.mean(axis=0)
    off = vertices - mean
    return mean, np.einsum("vi,vj->ij", off, off) / len(off)


def canonical_cloud(vertices_mm: Floats, sigma_mm: Floats | None) -> Cloud:
    """Move a cloud to its canonical frame, in which few vertices far out have no say. O(V)."""
    far = beyond(vertices_mm, times=FAR)
    mean, covariance = moments(vertices_mm[~far])
    scale = float(np.sqrt(np.trace(covariance)))
    turn = np.linalg.eigh(covariance / scale**2)[1][:, ::-1]
    points = np.einsum("vi,ij->vj", vertices_mm - mean, turn / scale)  # no BLAS: the same bits on any cores
    senses = np.where((points**3).sum(axis=0) < 0.0, -1.0, 1.0)
    senses[1] *= np.sign(np.linalg.det(turn * senses))  # right-handed: the middle axis gives way
    points *= senses
    if sigma_mm is None:
        weights = np.empty(0)
    else:
        weights = 1.0 / sigma_mm**2
        weights /= weights.mean()
    return Cloud(points, weights, mean, scale, turn * senses)


def voxel_moments(points: Floats, weights: Floats, side: float = FINE_SIDE) -> tuple[Ints, Floats]:
    """Weighted moments of the points in each voxel.

    Returns
    -------
    (M, 3) integer cell of each voxel, and (M, 10) sums of 1, x, y, z, xx, xy, xz, yy, yz, zz. O(V log V).

    """
    near = (np.abs(points) < REACH).all(axis=1)
    p, w = points[near], weights[near] if len(weights) else np.ones(near.sum())
    span = int(np.ceil(REACH / side))
    wide = 2 * span + 1
    x, y, z = (np.floor(p / side).astype(np.int64) + span).T
    keys, voxel = np.unique((x * wide + y) * wide + z, return_inverse=True)
    x, y, z = p.T
    terms = (w, *(w * one for one in (x, y, z, x * x, x * y, x * z, y * y, y * z, z * z)))
    rows: Floats = np.stack([np.bincount(voxel, term, len(keys)) for term in terms], axis=1)
    return np.stack([keys // (wide * wide), keys // wide % wide, keys % wide], axis=1), rows
