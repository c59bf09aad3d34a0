"""The seed paper's axis method with its slips mended, and nothing else of its idea: circles in sections."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats, Ints, Ints32
from burrscan.axis.fitting.starts import hemisphere
from burrscan.axis.rivals.seed import axis_through, needed
from burrscan.axis.rivals.seed_descent import Objective
from burrscan.axis.sections import fit_circles, sections, turned_to_z
from burrscan.inspection import Axis


def _frame(direction: Floats) -> Floats:
    """Rotation that takes the direction to +z, its rows varying smoothly away from -z."""
    theta, phi = np.arctan2(direction[1], direction[0]), np.arccos(np.clip(direction[2], -1.0, 1.0))
    return turned_to_z(float(theta), float(phi))


def find_axis_seed_mended(
    vertices_mm: Floats,
    faces: Ints32 | None,
    *,
    sigma_mm: Floats | None = None,
    seed: int = 0,
    directions: int = 50,
    planes: int = 20,
    tolerance_mm: float | None = None,
) -> Axis:
    """The seed's idea with its slips mended.

    Directions even over a hemisphere; steps in the tangent plane of the sphere, halved down to 0.001 degrees;
    every intersected triangle; RANSAC by the best sample yet, the same samples for every orientation;
    circles by
    Taubin's method, which Kåsa's bias on short arcs does not draw into the patch; distances capped at the
    tolerance, which is three sigma (or 1 % of the rms radius where no sigma is known); the centres' mean.
    """
    mesh = vertices_mm, needed(faces)
    evaluations = 0
    tolerance = tolerance_mm if tolerance_mm is not None else _own_tolerance(vertices_mm, sigma_mm)

    def circles_at(direction: Floats) -> Floats:
        points, index = sections(*mesh, _frame(direction), planes=planes, every=True)
        state: Ints = np.array([1 + seed % 2147483646], dtype=np.int64)
        circles: Floats = fit_circles(points, index, planes, tolerance, 0, True, True, state)
        return circles

    def objective(direction: Floats) -> float:
        nonlocal evaluations
        evaluations += 1
        circles = circles_at(direction)
        good = circles[np.isfinite(circles[:, 3])]
        return float((good[:, 5] @ good[:, 6]) / good[:, 6].sum()) if len(good) else np.inf

    grid = hemisphere(directions)
    values = [objective(direction) for direction in grid]
    best, value = grid[int(np.argmin(values))], min(values)
    step = float(np.sqrt(2.0 * np.pi / directions)) / 2.0
    while step > np.radians(0.001):
        best, value, moved = _compass_step(objective, best, value, step)
        step = step if moved else step / 2.0
    circles = circles_at(best)
    good = circles[np.isfinite(circles[:, 3])]
    centre = np.average(good[:, :2], axis=0, weights=good[:, 6] * (1.0 - good[:, 7]) + 1e-9)
    return axis_through(vertices_mm, _frame(best), centre, "seed-mended", evaluations)


def _own_tolerance(vertices: Floats, sigma: Floats | None) -> float:
    if sigma is not None:
        return 3.0 * float(np.median(sigma))
    return 0.01 * float(np.sqrt(vertices.var(axis=0).sum()))


def _compass_step(
    objective: Objective, direction: Floats, value: float, step: float
) -> tuple[Floats, float, bool]:
    """The best of four neighbours in the tangent plane, if it is better."""
    start = np.eye(3)[np.argmin(np.abs(direction))]
    u = np.cross(start, direction)
    u /= np.linalg.norm(u)
    v = np.cross(direction, u)
    trials = [direction + step * side for side in (u, -u, v, -v)]
    trials = [trial / np.linalg.norm(trial) for trial in trials]
    reached = [objective(trial) for trial in trials]
    k = int(np.argmin(reached))
    return (trials[k], reached[k], True) if reached[k] < value else (direction, value, False)
