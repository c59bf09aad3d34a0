"""Shapes that turn into themselves about more than one axis: what of an axis they leave open."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats

LARGEST_TILT = np.radians(5.0)
"""A direction less certain than this (one sigma) is called undetermined."""
LARGEST_OFFSET = 0.25
"""A position less certain than this share of the rms radius is called undetermined."""
AS_GOOD = 1.03
"""A plane or sphere with at most this many times the noise of the generatrix explains the data as well."""
EXACT = 5e-5
"""Deviations below this share of the rms radius are not the shape's: voxel means bend by as much."""
LEAST_SAGITTA = 3.0
"""An arc that bulges by less than this many sigma of one point is too short to tell its axis."""
ROUNDS = 4


def undetermined(points: Floats, weights: Floats, sigma: float, covariance: Floats) -> tuple[str, ...]:
    """Name what the data leave open.

    Parameters
    ----------
    points, weights
        (M, 3) in the canonical frame and (M,).
    sigma
        Noise of the same points about the free generatrix.
    covariance
        (4, 4) of (tilt, tilt, offset, offset), dimensionless.

    Returns
    -------
    Of "direction" (a sphere: any axis through its centre; or too short an arc) and "position" (a plane: any
    axis along its normal; or too short an arc).

    """
    open_ = []
    limit = AS_GOOD * max(sigma, EXACT)
    if _spread(covariance[:2, :2]) > LARGEST_TILT or sphere_sigma(points, weights) <= limit:
        open_.append("direction")
    if _spread(covariance[2:, 2:]) > LARGEST_OFFSET or plane_sigma(points, weights) <= limit:
        open_.append("position")
    return tuple(open_)


def too_short(points: Floats, frame: Floats, place: Floats, noise: float) -> bool:
    """Whether the arc that the points span about an axis bulges no more than their noise."""
    turned = (points - place) @ frame
    count, _ = np.histogram(np.arctan2(turned[:, 1], turned[:, 0]), bins=360, range=(-np.pi, np.pi))
    seen = np.flatnonzero(count > 0.1 * count.sum() / 360)
    widest = np.diff(np.append(seen, seen[0] + 360)).max()
    half = np.radians(min(361.0 - widest, 360.0)) / 2.0
    radius = float(np.median(np.hypot(turned[:, 0], turned[:, 1])))
    return bool(radius * (1.0 - np.cos(half)) < LEAST_SAGITTA * noise)


def _spread(covariance: Floats) -> float:
    return float(np.sqrt(max(np.linalg.eigvalsh(covariance)[-1], 0.0)))


def _robust(design: Floats, target: Floats, weights: Floats, scale_of: Floats | None) -> tuple[Floats, float]:
    """Least squares with Tukey's weights; the noise is the median absolute residual."""
    factor = weights
    sigma = np.inf
    for _ in range(ROUNDS):
        weighted = design * factor[:, None]
        solution = np.linalg.solve(weighted.T @ design + 1e-15 * np.eye(design.shape[1]), weighted.T @ target)
        residual = target - design @ solution
        if scale_of is not None:
            centre = solution[:3]
            radius = np.sqrt(max(solution[3] + centre @ centre, 0.0))
            residual = np.linalg.norm(scale_of - centre, axis=1) - radius
        residual = residual * np.sqrt(weights)
        sigma = float(np.median(np.abs(residual))) / 0.6745
        u = np.clip(1.0 - (residual / (5.0 * max(sigma, 1e-12))) ** 2, 0.0, None)
        factor = weights * u * u
    return np.asarray(solution, dtype=np.float64), sigma


def sphere_sigma(points: Floats, weights: Floats) -> float:
    """Noise of the points about their best sphere: |p|² = 2 c · p + (R² - |c|²), robustly."""
    design = np.column_stack([2.0 * points, np.ones(len(points))])
    return _robust(design, np.einsum("ij,ij->i", points, points), weights, points)[1]


def plane_sigma(points: Floats, weights: Floats) -> float:
    """Noise of the points about their best plane (the canonical z is along the least extent)."""
    design = np.column_stack([points[:, :2], np.ones(len(points))])
    solution, sigma = _robust(design, points[:, 2], weights, None)
    return sigma / float(np.sqrt(1.0 + solution[0] ** 2 + solution[1] ** 2))
