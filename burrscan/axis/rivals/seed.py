"""The axis method of the seed paper (Claes, Koninckx, Bruyninckx 2005, sections 3 and 5.1) in two readings.

:func:`find_axis_seed` is the charitable reading: wherever the text is open or contradicts itself, what
reproduces what the paper shows. :func:`find_axis_seed_literal` is what is printed. docs/seed.md has both,
sentence by sentence.

Common to both, as the paper has it:

- A triangle counts as intersected when the mean of its corners' layers is not an integer, so one that spans
  three layers evenly is missed; its mean corner stands for the intersection.
- Five RANSAC rounds per circle ("5 RANSAC iterations will do").
- Rejected intersection points count in f too: section 4 reads the burr's distances. In the charitable
  reading each counts as the tolerance that it was rejected by, in the literal one with all of its distance.
- Steps are taken in (θ, φ) as if they were a plane, with s = Δθ / |∇f|; the paper's formula is garbled in
  print.
- The location is the centre nearest to the other centres after RANSAC, not their mean.

:mod:`burrscan.axis.rivals.seed_mended` mends these and nothing else of the idea: circles in
parallel sections.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Literal

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from burrscan.arrays import Floats, Ints32
from burrscan.axis.basis import sensed
from burrscan.axis.rivals.seed_descent import GRADIENTS, levenberg_marquardt, steepest_descent
from burrscan.axis.sections import fit_circles, sections, turned_to_z
from burrscan.errors import InputError
from burrscan.inspection import Axis

Quality = Literal["circle_distance", "bounding_box", "max_centre_distance"]
Sampling = Literal["even", "uniform", "naive"]
Gradient = Literal["central", "forward"]
Mean = Literal["points", "circles"]
Outliers = Literal["tolerance", "distance"]
Draws = Literal["same", "fresh"]
Halving = Literal["run", "gradient"]
Descent = Literal["steepest", "levenberg_marquardt"]
_KNOWN: dict[str, tuple[str, ...]] = {
    "quality": ("circle_distance", "bounding_box", "max_centre_distance"),
    "sampling": ("even", "uniform", "naive"),
    "descent": ("steepest", "levenberg_marquardt"),
    "gradient": tuple(GRADIENTS),
    "mean": ("points", "circles"),
    "outliers": ("tolerance", "distance"),
    "draws": ("same", "fresh"),
    "halving": ("run", "gradient"),
}


def orientation_grid(n: int, sampling: str) -> Floats:
    """(n², 2) orientations (θ, φ) in radians, θ = iπ/n with i = 0..n-1 (section 3.1, figure 5).

    φ by ``sampling``: ``"uniform"`` is the printed acos(2j/n - 1), j = 0..n-1, which visits one pole n times
    and leaves 7 distinct directions of the 9 for n = 3; ``"even"`` is acos((2j+1)/n - 1), the middles of n
    zones of equal area, which has the 9 that the text counts, with as many in "any small area on the
    sphere"; ``"naive"`` is jπ/n.
    """
    theta = np.arange(n) * np.pi / n
    j = np.arange(n)
    phi = {"uniform": np.arccos(2.0 * j / n - 1.0), "even": np.arccos((2.0 * j + 1.0) / n - 1.0)}.get(
        sampling, j * np.pi / n
    )
    return np.array([(t, p) for t in theta for p in phi])


def quality_of(circles: Floats, measure: str, *, mean: str = "points", outliers: str = "tolerance") -> float:
    """How badly the sections resemble circles about one axis (section 5.1); infinite where there are none.

    Parameters
    ----------
    circles
        (P + 1, 8) as :func:`burrscan.axis.sections.fit_circles` gives them, mm.
    measure
        Mean distance to the circles (mm), area of the box of their centres (mm²), or its longer side (mm).
    mean
        Over all points of all circles, or over the circles' own means: "average over all the intersection
        points in a circle, and over all circles" may be either. In the second a few strays weigh as much as a
        circle.
    outliers
        What a point beyond RANSAC's tolerance counts as: the tolerance, or its whole distance. The paper
        "removes" it and averages over "each intersection point" all the same. Where a plane meets several
        surfaces, as a wheel's rim and the face of its web, whole distances make f larger at the true axis
        than elsewhere; the tolerance is the robust cost of the paper's own source on RANSAC (Hartley,
        Zisserman; MSAC of Torr and Zisserman 2000).

    """
    good = circles[np.isfinite(circles[:, 3])]
    if len(good) == 0:
        return np.inf
    if measure == "circle_distance":
        distance = good[:, 5 if outliers == "tolerance" else 4]
        return float(np.average(distance, weights=good[:, 6] if mean == "points" else None))
    sides = np.ptp(good[:, :2], axis=0)
    return float(sides[0] * sides[1] if measure == "bounding_box" else sides.max())


def find_axis_seed(
    vertices_mm: Floats,
    faces: Ints32 | None,
    *,
    sigma_mm: Floats | None = None,  # noqa: ARG001
    seed: int = 0,
    quality: Quality = "circle_distance",
    sampling: Sampling = "even",
    descent: Descent = "steepest",
    gradient: Gradient = "central",
    mean: Mean = "points",
    outliers: Outliers = "tolerance",
    draws: Draws = "same",
    halving: Halving = "run",
    trials: int = 5,
    n: int = 3,
    planes: int = 10,
    tolerance_mm: float = 1.0,
    ransac_rounds: int = 5,
    least_share: float = 0.01,
    keep_ratio: float = 1.0,
    most_evaluations: int = 0,
) -> Axis:
    """Find the axis as the seed paper does, in the reading that reproduces what it shows.

    Parameters
    ----------
    vertices_mm, faces
        (V, 3) and (T, 3); faces are needed.
    seed
        Of the RANSAC samples.
    quality, mean, outliers
        What f measures: :func:`quality_of`.
    sampling
        Of the n² orientations of the start: :func:`orientation_grid`.
    descent
        Steepest descent in two stages, or Levenberg-Marquardt (section 3.1).
    gradient
        Differences to both sides, or forward ones as printed, which cost half and end beside the minimum.
    draws
        The same random samples for every orientation, or fresh ones, which make f itself noisy.
    halving
        Of the step s: one number over a run, as "s_j+1 = s_j / 2" has it, or chosen anew at every gradient.
    trials
        Steps that fail before a run ends: "does not become smaller after say 5 iterations".
    n
        n² orientations are tried.
    planes
        P: the mesh is cut by P - 1 planes.
    tolerance_mm
        RANSAC tolerance; 1 mm suits the paper's wheel of 100 mm radius and noise of 1 mm.
    ransac_rounds
        Samples per circle; 0 for the number that each sample's share of outliers sets (section 3.2).
    least_share
        Pieces of the mesh with less than this share of its vertices are set aside as strays: section 2's
        "extended filtering removes data with too much uncertainty". 0 keeps all.
    keep_ratio
        Below 1 the mesh is simplified to this share of its triangles first.
    most_evaluations
        Where the descent ends if it has not before; 0 for no limit, as the paper names none.

    Returns
    -------
    Axis with ``evaluations`` of f, every one counted, and no covariance (NaN). O(V + T) per evaluation.

    Raises
    ------
    InputError
        Without faces, or for a parameter that is none.

    """
    words: dict[str, str] = {"quality": quality, "sampling": sampling, "descent": descent}
    words |= {"gradient": gradient, "mean": mean, "outliers": outliers, "draws": draws, "halving": halving}
    _check(words, n, planes, trials, tolerance_mm)
    if most_evaluations < 0 or 0 < most_evaluations < n * n:
        raise InputError(f"most_evaluations must be 0, for no limit, or at least n² = {n * n}")
    mesh = _simplified(*without_strays(vertices_mm, needed(faces), least_share), keep_ratio)
    first = 1 + seed % 2147483646
    state = np.array([first], dtype=np.int64)
    evaluations = 0

    def circles_at(orientation: Floats) -> Floats:
        if draws == "same":
            state[0] = first
        points, index = sections(*mesh, turned_to_z(*orientation), planes=planes)
        circles: Floats = fit_circles(points, index, planes, tolerance_mm, ransac_rounds, False, False, state)
        return circles

    def objective(orientation: Floats) -> float:
        nonlocal evaluations
        if evaluations == most_evaluations > 0:
            return np.inf  # no descent goes there
        evaluations += 1
        return quality_of(circles_at(orientation), quality, mean=mean, outliers=outliers)

    grid = orientation_grid(n, sampling)
    values = [objective(orientation) for orientation in grid]
    best, value = grid[int(np.argmin(values))], min(values)
    for step in (np.pi / (2 * n), np.pi / (2 * n**2)):
        if descent == "steepest":
            best, value = steepest_descent(
                objective, best, value, step, gradient=gradient, trials=trials, halving=halving
            )
        else:
            best, value = levenberg_marquardt(objective, best, value, step)
    turn = turned_to_z(*best)
    centre = nearest_to_others(_centres(circles_at(best)), tolerance_mm)
    return axis_through(vertices_mm, turn, centre, "seed", evaluations)


def find_axis_seed_literal(
    vertices_mm: Floats,
    faces: Ints32 | None,
    *,
    sigma_mm: Floats | None = None,
    seed: int = 0,
    quality: Quality = "circle_distance",
    n: int = 3,
    planes: int = 10,
    tolerance_mm: float = 1.0,
    ransac_rounds: int = 5,
) -> Axis:
    """Find the axis by what the seed paper prints.

    The printed grid with its repeated pole, forward differences, five halvings after the first step, the
    mean of the circles' means, outliers with their whole distance, fresh random samples at every orientation,
    the mesh with its strays.
    Parameters, returns and errors are those of :func:`find_axis_seed`.
    """
    axis = find_axis_seed(
        vertices_mm,
        faces,
        sigma_mm=sigma_mm,
        seed=seed,
        quality=quality,
        n=n,
        planes=planes,
        tolerance_mm=tolerance_mm,
        ransac_rounds=ransac_rounds,
        sampling="uniform",
        gradient="forward",
        trials=6,
        halving="gradient",
        mean="circles",
        outliers="distance",
        draws="fresh",
        least_share=0.0,
    )
    return replace(axis, method="seed-literal")


def _check(words: Mapping[str, str], n: int, planes: int, trials: int, tolerance_mm: float) -> None:
    for name, value in words.items():
        if value not in _KNOWN[name]:
            raise InputError(f"{name} must be one of {', '.join(_KNOWN[name])}, not '{value}'")
    if n < 1 or planes < 2 or trials < 1 or not tolerance_mm > 0.0:
        raise InputError("n and trials must be at least 1, planes at least 2 and tolerance_mm above 0")


def needed(faces: Ints32 | None) -> Ints32:
    """The faces, or an :class:`InputError` where there are none."""
    if faces is None or len(faces) == 0:
        raise InputError("the seed's sections need triangles: hand over a mesh, or use method='profile'")
    return faces


def without_strays(vertices: Floats, faces: Ints32, least_share: float) -> tuple[Floats, Ints32]:
    """The mesh (V, 3), (T, 3) without the pieces that hold less than a share of its vertices. O(V + T).

    Raises
    ------
    InputError
        Where no piece is as large as that, or the share is none.

    """
    if not 0.0 <= least_share < 1.0:
        raise InputError("least_share must be at least 0 and below 1")
    if least_share == 0.0:
        return vertices, faces
    count = len(vertices)
    ends = faces[:, [0, 0]].ravel(), faces[:, [1, 2]].ravel()
    links = coo_array((np.ones(len(ends[0])), ends), shape=(count, count))
    piece = connected_components(links, directed=False)[1]
    keep = (np.bincount(piece) >= least_share * count)[piece]
    if not keep.any():
        raise InputError(f"no piece of the mesh has {least_share:.1%} of its vertices: lower least_share")
    index = np.cumsum(keep, dtype=np.int32) - 1
    return vertices[keep], np.ascontiguousarray(index[faces[keep[faces[:, 0]]]])


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


def axis_through(vertices: Floats, turn: Floats, centre: Floats, method: str, evaluations: int) -> Axis:
    """The axis along the last row of a turn (3, 3) through a centre (2,) of the turned frame, mm."""
    direction = sensed(turn[2])
    middle = vertices.mean(axis=0)
    point = turn.T @ np.array([*centre, 0.0])
    point += direction * (direction @ (middle - point))
    return Axis(point, direction, np.full((4, 4), np.nan), method, evaluations)
