"""Shapes that turn into themselves about more than one axis: what of an axis they leave open."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from burrscan.arrays import Floats
from burrscan.axis.fitting.covariance import AxisCovariance
from burrscan.axis.fitting.fit import TUKEY, Curve, Fit, curve_of, meridian, off_piece, piece_of
from burrscan.axis.jit import kernel
from burrscan.robust import MEDIAN_SIZE

Model: TypeAlias = Callable[[Floats, Floats], Floats]
"""From points (M, 3) and weights (M,) to their distances (M,) off the best shape of a kind."""
LARGEST_TILT = np.radians(5.0)
"""A direction less certain than this (one sigma) is called undetermined."""
LARGEST_OFFSET = 0.25
"""A position less certain than this share of the rms radius is called undetermined."""
EXACT = 5e-5
"""Deviations below this share of the rms radius are not the shape's: voxel means bend by as much."""
NEAR, CLEARLY = 0.06, 3.0
"""A plane or sphere within this share of the rms radius, or so many times the noise, is looked at more
closely."""
FEW = 1000
"""Points that suffice to tell that it is further off."""
MOST_LOOKED_AT = 200_000
"""Raw points whose squares are summed, evenly thinned: bounds the time; the sum of so many is known to 0.3
%."""
SURE = 5.0
"""Standard deviations by which a generatrix must beat a plane or sphere beyond its number of unknowns."""
LEAST_SAGITTA = 3.0
"""An arc that bulges by less than this many sigma of one point is too short to tell its axis."""
ROUNDS = 4
"""Reweightings of a plane or sphere, which is linear: each needs only weights of the right size, not
converged ones."""


def undetermined(
    points: Floats,
    weights: Floats,
    raw: Floats,
    raw_weights: Floats,
    *,
    fit: Fit,
    known: AxisCovariance,
) -> tuple[str, ...]:
    """Name what the data leave open.

    Parameters
    ----------
    points, weights
        (M, 3) in the canonical frame and (M,): voxel means of the smoothed points.
    raw, raw_weights
        (V, 3) the points themselves and (V,) weights, or none.
    fit, known
        The fit to all points, and its covariance.

    Returns
    -------
    Of "direction" (a sphere: any axis through its centre; or too short an arc) and "position" (a plane: any
    axis along its normal; or too short an arc).

    """
    if too_short(points, fit.frame, fit.place, max(known.noise, fit.sigma)):
        return ("direction", "position")
    open_ = []
    few, few_weights = (data[:: len(points) // FEW + 1] for data in (points, weights))
    for flag, model, part, largest in (
        ("direction", sphere_residuals, slice(0, 2), LARGEST_TILT),
        ("position", plane_residuals, slice(2, 4), LARGEST_OFFSET),
    ):
        sigma = robust_sigma(model(few, few_weights) * np.sqrt(few_weights))
        if _largest_sigma(known.covariance[part, part]) > largest or (
            sigma <= max(NEAR, CLEARLY * known.noise) and _explains(model, raw, raw_weights, fit, known)
        ):
            open_.append(flag)
    return tuple(open_)


def _explains(model: Model, raw: Floats, weights: Floats, fit: Fit, known: AxisCovariance) -> bool:
    """Whether a plane or sphere explains the raw points as well as the generatrix does.

    The likelihood ratio: twice the log of it, with a truncated square as the log density, has the number of
    the generatrix's unknowns as its mean, if the simple shape is the true one (Wilks); points that err alike
    count as one. Voxel means cannot tell: those of a sphere lie inside it, by more where vertices are far
    apart. Nor can most of the points, of a plate: its rim is what tells where its axis lies.
    """
    independent = min(known.independent / len(raw), 1.0)
    step = len(raw) // MOST_LOOKED_AT + 1
    raw, weights = raw[::step], weights[::step] if len(weights) else np.ones(len(raw[::step]))
    off_curve = _off_curve(raw, fit.frame, fit.place, curve_of(fit))
    near = np.isfinite(off_curve)
    if 2 * np.count_nonzero(near) < len(near):
        return False  # a generatrix that misses most points is no measure
    raw, weights, off_curve = raw[near], weights[near], off_curve[near]
    variance = max(known.noise, EXACT) ** 2
    simple, free = (
        np.minimum(weights * off**2 / variance, TUKEY**2).sum() for off in (model(raw, weights), off_curve)
    )
    unknowns = 3.0 * np.count_nonzero(fit.gram[:, 0, 0]) + 4.0
    return bool(independent * (simple - free) <= unknowns + SURE * np.sqrt(2.0 * unknowns))


@kernel
def _off_curve(points: Floats, frame: Floats, place: Floats, curve: Curve) -> Floats:
    """(V,) distance off the generatrix; NaN far from it."""
    off = np.full(points.shape[0], np.nan)
    for i in range(points.shape[0]):
        x, y, z = meridian(points, i, frame, place)
        r = np.sqrt(x * x + y * y)
        k = piece_of(z, r, curve)
        if k >= 0:
            off[i] = off_piece(z, r, k, curve)[1]
    return off


def too_short(points: Floats, frame: Floats, place: Floats, noise: float) -> bool:
    """Whether the arc that the points span about an axis bulges no more than their noise."""
    turned = (points - place) @ frame
    count, _ = np.histogram(np.arctan2(turned[:, 1], turned[:, 0]), bins=360, range=(-np.pi, np.pi))
    seen = np.flatnonzero(count > 0.1 * count.sum() / 360)
    widest = np.diff(np.append(seen, seen[0] + 360)).max()
    half = np.radians(min(361.0 - widest, 360.0)) / 2.0
    radius = float(np.median(np.hypot(turned[:, 0], turned[:, 1])))
    return bool(radius * (1.0 - np.cos(half)) < LEAST_SAGITTA * noise)


def _largest_sigma(covariance: Floats) -> float:
    return float(np.sqrt(max(np.linalg.eigvalsh(covariance)[-1], 0.0)))


def robust_sigma(residuals: Floats) -> float:
    """Standard deviation by the median of the size."""
    return float(np.median(np.abs(residuals))) / MEDIAN_SIZE


def _robust(design: Floats, target: Floats, weights: Floats, residuals: Callable[[Floats], Floats]) -> Floats:
    """Least squares with Tukey's weights by the residuals (distances) that a solution leaves."""
    factor, off = weights, target
    for _ in range(ROUNDS):
        weighted = design * factor[:, None]
        solution = np.linalg.solve(weighted.T @ design + 1e-15 * np.eye(design.shape[1]), weighted.T @ target)
        off = residuals(np.asarray(solution, dtype=np.float64))
        size = np.abs(off) * np.sqrt(weights)
        u = np.clip(1.0 - (size / (TUKEY * max(robust_sigma(size), 1e-12))) ** 2, 0.0, None)
        factor = weights * u * u
    return off


def sphere_residuals(points: Floats, weights: Floats) -> Floats:
    """(M,) distances off the best sphere: |p|² = 2 c · p + (R² - |c|²), robustly."""
    design = np.column_stack([2.0 * points, np.ones(len(points))])

    def off(solution: Floats) -> Floats:
        centre = solution[:3]
        radius = np.sqrt(max(solution[3] + centre @ centre, 0.0))
        return np.asarray(np.linalg.norm(points - centre, axis=1) - radius)

    return _robust(design, np.einsum("ij,ij->i", points, points), weights, off)


def plane_residuals(points: Floats, weights: Floats) -> Floats:
    """(M,) distances off the best plane, robustly (the canonical z is along the least extent)."""
    design = np.column_stack([points[:, :2], np.ones(len(points))])

    def off(solution: Floats) -> Floats:
        return np.asarray((points[:, 2] - design @ solution) / np.sqrt(1.0 + solution[:2] @ solution[:2]))

    return _robust(design, points[:, 2], weights, off)
