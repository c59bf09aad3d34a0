"""Small planar patches of a cloud, each with a normal: what the starts are found from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Floats, Ints

COARSE = 3
"""A surfel's voxel is this many fine voxels wide."""
_IN_LINE = 1e-3
"""Of the largest eigenvalue: a middle one below that is the rounding of points that are one, or in line."""


@dataclass(frozen=True)
class Surfels:
    """(M, 3) mean positions, (M, 3) unit normals of unknown sense, (M,) weights."""

    points: Floats
    normals: Floats
    weights: Floats


def planes_of(rows: Floats) -> tuple[Floats, Floats]:
    """Unit normals (M, 3) of planes through points of moments (M, 10), and how far from planar those are.

    The latter is the smallest over the middle eigenvalue of the covariance, 1 where there is no plane.
    """
    mean, products = rows[:, 1:4] / rows[:, :1], rows[:, 4:] / rows[:, :1]
    covariance = products[:, [[0, 1, 2], [1, 3, 4], [2, 4, 5]]] - mean[:, :, None] * mean[:, None]
    values, vectors = np.linalg.eigh(covariance)
    least, middle, largest = values.T
    plane = (middle > 0.0) & (middle >= _IN_LINE * largest)
    return vectors[..., 0], np.where(plane, np.maximum(least, 0.0) / np.where(plane, middle, 1.0), 1.0)


def surfels_of(cells: Ints, rows: Floats) -> Surfels:
    """Planar patches from the fine voxels' moments, in the order of their voxels.

    Each voxel takes its normal from itself or from its 3×3×3 neighbourhood, whichever is flatter: the first
    where the surface is sharp, the second where the noise is large.
    """
    extent = cells.max(axis=0) // COARSE + 3
    flat = np.ravel_multi_index(tuple((cells // COARSE + 1).T), extent)
    used, voxel = np.unique(flat, return_inverse=True)
    sums: Floats = np.stack([np.bincount(voxel, one, len(used)) for one in rows.T], axis=1)
    index = np.full(np.prod(extent), len(used))  # one row more, of zeros, for voxels without points
    index[used] = np.arange(len(used))
    steps: Ints = np.asarray(np.ravel_multi_index(tuple(np.indices((3, 3, 3)).reshape(3, -1)), extent))
    padded = np.concatenate([sums, np.zeros((1, 10))])
    wide: Floats = np.sum([padded[index[used + step]] for step in steps - steps[13]], axis=0)
    typical = float((sums[:, 0] ** 2).sum() / sums[:, 0].sum())
    (normals, flatness), (normals_around, blunt) = planes_of(sums), planes_of(wide)
    flatness[sums[:, 0] < 0.1 * typical] = 1.0
    around = blunt <= flatness
    normals, flatness = np.where(around[:, None], normals_around, normals), np.minimum(flatness, blunt)
    weights = np.minimum(sums[:, 0], typical) / (flatness + 0.01)
    weights[flatness > 0.5] = 0.0
    return Surfels(sums[:, 1:4] / sums[:, :1], normals, weights / max(float(weights.sum()), 1e-300))
