"""The axis method of the seed paper (Claes, Koninckx, Bruyninckx 2005, sections 3.1, 3.2 and 5.1).

Kept as the paper has it, where it is odd or says nothing:

- The grid of orientations visits one pole n times and never the other end: 7 distinct directions for n = 3.
- A triangle counts as intersected when the mean of its corners' layers is not an integer, so one that spans
three
  layers evenly is missed; its mean corner stands for the intersection.
- Each RANSAC sample sets the number of samples anew from its own share of outliers, not from the best one
yet. A
  hundred samples are the most taken; ``ransac_rounds=5`` is what the paper says "will do" for its data.
- The mean distance is over all intersection points of a circle, outliers included, then over the circles.
- Steps are taken in (θ, φ) as if they were a plane, with s = Δθ / |∇f| (the paper's formula is garbled in
print).
- The location is the centre nearest to the other centres after RANSAC, not their mean.

:func:`find_axis_seed_mended` mends these and nothing else of the idea: circles in parallel sections.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np

from burrscan.arrays import Floats, Ints, Ints32
from burrscan.axis.basis import sensed
from burrscan.axis.sections import fit_circles, sections, turned_to_z
from burrscan.axis.starts import hemisphere
from burrscan.errors import InputError
from burrscan.inspection import Axis

Quality = Literal["circle_distance", "bounding_box", "max_centre_distance"]
Objective = Callable[[Floats], float]
QUALITIES = ("circle_distance", "bounding_box", "max_centre_distance")
HALVINGS = 5
GROWTH = 10.0


def orientation_grid(n: int, sampling: str) -> Floats:
    """(n², 2) orientations (θ, φ): θ = iπ/n with φ = acos(2j/n - 1), or jπ/n if naive (figure 5)."""
    theta = np.arange(n) * np.pi / n
    j = np.arange(n)
    phi = np.arccos(2.0 * j / n - 1.0) if sampling == "uniform" else j * np.pi / n
    return np.array([(t, p) for t in theta for p in phi])


def quality_of(circles: Floats, measure: str) -> float:
    """How badly the sections resemble circles about one axis (section 5.1); infinite where there are none."""
    good = circles[np.isfinite(circles[:, 3])]
    if len(good) == 0:
        return np.inf
    if measure == "circle_distance":
        return float(good[:, 4].mean())
    sides = np.ptp(good[:, :2], axis=0)
    return float(sides[0] * sides[1] if measure == "bounding_box" else sides.max())


def steepest_descent(objective: Objective, start: Floats, value: float, step: float) -> tuple[Floats, float]:
    """Steps of length ``step``, halved up to five times until they descend; stops when none does."""
    while True:
        ahead = np.array([objective(start + side) for side in step * np.eye(2)])
        gradient = (ahead - value) / step
        size = float(np.linalg.norm(gradient))
        if not np.isfinite(size) or size == 0.0:
            return start, value
        s = step / size
        for _ in range(HALVINGS + 1):
            trial = start - s * gradient
            reached = objective(trial)
            if reached < value:
                break
            s /= 2.0
        else:
            return start, value
        start, value = trial, reached


def levenberg_marquardt(
    objective: Objective, start: Floats, value: float, step: float
) -> tuple[Floats, float]:
    """Damped Newton steps; gradient and Hessian from five forward differences, as section 3.1 counts them."""
    damping = 1.0
    for _ in range(20):
        e, h = np.array([[step, 0.0], [0.0, step]]), step * step
        a, b = objective(start + e[0]), objective(start + e[1])
        aa, bb = objective(start + 2 * e[0]), objective(start + 2 * e[1])
        ab = objective(start + e[0] + e[1])
        gradient = np.array([a - value, b - value]) / step
        cross = (ab - a - b + value) / h
        hessian = np.array([[(aa - 2 * a + value) / h, cross], [cross, (bb - 2 * b + value) / h]])
        if not np.isfinite(hessian).all():
            return start, value
        while damping < GROWTH**5:
            scale = damping * max(float(np.abs(hessian).max()), 1e-12)
            trial = start - np.linalg.solve(hessian + scale * np.eye(2), gradient)
            reached = objective(trial)
            if reached < value:
                break
            damping *= GROWTH
        else:
            return start, value
        settled = value - reached < 1e-3 * value
        start, value, damping = trial, reached, damping / GROWTH
        if settled:
            return start, value
    return start, value


DESCENTS = {"steepest": steepest_descent, "levenberg_marquardt": levenberg_marquardt}


def find_axis_seed(
    vertices_mm: Floats,
    faces: Ints32 | None,
    *,
    sigma_mm: Floats | None = None,  # noqa: ARG001
    seed: int = 0,
    quality: Quality = "circle_distance",
    sampling: Literal["uniform", "naive"] = "uniform",
    descent: Literal["steepest", "levenberg_marquardt"] = "steepest",
    n: int = 3,
    planes: int = 10,
    tolerance_mm: float = 1.0,
    ransac_rounds: int = 0,
    keep_ratio: float = 1.0,
) -> Axis:
    """Find the axis as the seed paper does.

    Parameters
    ----------
    vertices_mm, faces
        (V, 3) and (T, 3); faces are needed.
    seed
        Of the RANSAC samples.
    quality
        Mean distance to the circles, area of the box of their centres, or its longer side (section 5.1).
    sampling
        Orientations uniform on the sphere, or naive in the angles (figure 5).
    descent
        Steepest descent in two stages, or Levenberg-Marquardt (section 3.1).
    n
        n² orientations are tried.
    planes
        P: the mesh is cut by P - 1 planes.
    tolerance_mm
        RANSAC tolerance; 1 mm suits the paper's wheel of 100 mm radius and noise of 1 mm.
    ransac_rounds
        Samples per circle; 0 for the adaptive number.
    keep_ratio
        Below 1 the mesh is simplified to this share of its triangles first.

    Returns
    -------
    Axis with ``evaluations`` of f and no covariance (NaN). O(V + T) per evaluation.

    Raises
    ------
    InputError
        Without faces, or for a parameter that is none.

    """
    _check(quality, sampling, descent, n, planes, tolerance_mm)
    mesh = _simplified(vertices_mm, _needed(faces), keep_ratio)
    state = np.array([1 + seed % 2147483646], dtype=np.int64)
    evaluations = 0

    def circles_at(orientation: Floats) -> Floats:
        points, index = sections(*mesh, turned_to_z(*orientation), planes=planes)
        circles: Floats = fit_circles(points, index, planes, tolerance_mm, ransac_rounds, False, False, state)
        return circles

    def objective(orientation: Floats) -> float:
        nonlocal evaluations
        evaluations += 1
        return quality_of(circles_at(orientation), quality)

    grid = orientation_grid(n, sampling)
    values = [objective(orientation) for orientation in grid]
    best, value = grid[int(np.argmin(values))], min(values)
    for step in (np.pi / (2 * n), np.pi / (2 * n**2)):
        best, value = DESCENTS[descent](objective, best, value, step)
    turn = turned_to_z(*best)
    centre = nearest_to_others(_centres(circles_at(best)), tolerance_mm)
    return _axis(vertices_mm, turn, centre, "seed", evaluations)


def _check(quality: str, sampling: str, descent: str, n: int, planes: int, tolerance_mm: float) -> None:
    for name, value, known in (
        ("quality", quality, QUALITIES),
        ("sampling", sampling, ("uniform", "naive")),
        ("descent", descent, tuple(DESCENTS)),
    ):
        if value not in known:
            raise InputError(f"{name} must be one of {', '.join(known)}, not '{value}'")
    if n < 1 or planes < 2 or not tolerance_mm > 0.0:
        raise InputError("n must be at least 1, planes at least 2 and tolerance_mm above 0")


def _needed(faces: Ints32 | None) -> Ints32:
    if faces is None or len(faces) == 0:
        raise InputError("the seed's sections need triangles: hand over a mesh, or use method='profile'")
    return faces


def _simplified(vertices: Floats, faces: Ints32, keep_ratio: float) -> tuple[Floats, Ints32]:
    if not 0.0 < keep_ratio <= 1.0:
        raise InputError("keep_ratio must be above 0 and at most 1")
    if keep_ratio == 1.0:
        return vertices, faces
    try:
        import fast_simplification  # noqa: PLC0415
    except ModuleNotFoundError as error:
        raise InputError(
            "keep_ratio below 1 needs the package fast-simplification: pip install it"
        ) from error
    # It works in single precision: take the mesh to its own middle first.
    middle = vertices.mean(axis=0)
    small, few = fast_simplification.simplify(
        (vertices - middle).astype(np.float32), faces, target_reduction=1.0 - keep_ratio
    )
    return small.astype(np.float64) + middle, np.ascontiguousarray(few, dtype=np.int32)


def _centres(circles: Floats) -> Floats:
    centres = circles[np.isfinite(circles[:, 3]), :2]
    if len(centres) == 0:
        raise InputError("no plane section of the mesh has enough triangles for a circle")
    return centres


def nearest_to_others(centres: Floats, tolerance: float) -> Floats:
    """The centre with the most others within the tolerance; of its company, the one nearest to the rest."""
    apart = np.linalg.norm(centres[:, None] - centres[None], axis=2)
    company = apart[np.argmax((apart <= tolerance).sum(axis=1))] <= tolerance
    inside = np.flatnonzero(company)
    chosen: Floats = centres[inside[np.argmin(apart[np.ix_(inside, inside)].sum(axis=1))]]
    return chosen


def _axis(vertices: Floats, turn: Floats, centre: Floats, method: str, evaluations: int) -> Axis:
    direction = sensed(turn[2])
    middle = vertices.mean(axis=0)
    point = turn.T @ np.array([*centre, 0.0])
    point += direction * (direction @ (middle - point))
    return Axis(point, direction, np.full((4, 4), np.nan), method, evaluations)


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
    mesh = vertices_mm, _needed(faces)
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
    return _axis(vertices_mm, _frame(best), centre, "seed-mended", evaluations)


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
