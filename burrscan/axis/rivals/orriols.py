"""A stack of cone frusta, axis and generatrix in turn.

X. Orriols, A. Willis, X. Binefa, D. B. Cooper, "Bayesian estimation of axial symmetries from partial data, a
generative model approach", Computer Vision Center tech. report, 2000 (the seed's reference 13).
"""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats, Ints32
from burrscan.axis.fitting.fit import frame_of, rotation_by
from burrscan.axis.points.cloud import canonical_cloud, voxel_moments
from burrscan.axis.rivals.common import bare_axis
from burrscan.axis.rivals.line_complex import find_axis_line_complex_robust
from burrscan.inspection import Axis

STEEPEST = 5.0
"""Slope dr/dz beyond which a frustum is a disc and tells its radius badly."""


def find_axis_orriols(
    vertices_mm: Floats,
    faces: Ints32 | None,
    *,
    sigma_mm: Floats | None = None,
    seed: int = 0,
    frusta: int = 24,
    rounds: int = 60,
) -> Axis:
    """Alternate between the frusta, given the axis, and the axis, given the frusta.

    Maximum likelihood with Gaussian noise of the radius; started from the robust line complex. Voxel means
    stand
    for the points. O(V) once, then O(voxels) a round; alternation converges linearly, so rounds are many.
    """
    start = find_axis_line_complex_robust(vertices_mm, faces, sigma_mm=sigma_mm, seed=seed)
    cloud = canonical_cloud(vertices_mm, sigma_mm)
    _, rows = voxel_moments(cloud.points, cloud.weights)
    points, weights = rows[:, 1:4] / rows[:, :1], rows[:, 0]
    frame = frame_of(cloud.rotation.T @ start.direction)
    place = cloud.rotation.T @ (start.point_mm - cloud.mean_mm) / cloud.scale_mm
    for _ in range(rounds):
        turned = (points - place) @ frame
        z, r = turned[:, 2], np.hypot(turned[:, 0], turned[:, 1])
        slope, residual = _frusta(z, r, weights, frusta)
        factor = weights / (1.0 + slope**2)
        cosine, sine = turned[:, 0] / r, turned[:, 1] / r
        lever = z + slope * r
        J = np.stack([-lever * sine, lever * cosine, cosine, sine], axis=1)
        H = (J * factor[:, None]).T @ J
        step = -np.linalg.solve(H + 1e-9 * np.trace(H) * np.eye(4), J.T @ (factor * residual))
        frame = frame @ rotation_by(step[:2]).T
        place = place - frame @ np.array([step[2], step[3], 0.0])
    return bare_axis(cloud, frame[:, 2], place, "orriols", rounds)


def _frusta(z: Floats, r: Floats, weights: Floats, count: int) -> tuple[Floats, Floats]:
    """Slope of the frustum under each point, and the point's radial distance from it."""
    low, high = z.min(), z.max()
    layer = np.minimum(((z - low) / max(high - low, 1e-12) * count).astype(np.int64), count - 1)

    def total(values: Floats) -> Floats:
        return np.bincount(layer, weights=weights * values, minlength=count).astype(np.float64)

    mass = np.maximum(total(np.ones_like(z)), 1e-12)
    mz, mr = total(z) / mass, total(r) / mass
    dz, dr = z - mz[layer], r - mr[layer]
    slope = np.clip(total(dz * dr) / np.maximum(total(dz * dz), 1e-12), -STEEPEST, STEEPEST)
    return slope[layer], dr - slope[layer] * dz
