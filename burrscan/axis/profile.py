"""The best axis: several cheap starts, then a free generatrix fitted to all points."""

from __future__ import annotations

from itertools import product

import numpy as np

from burrscan.arrays import Floats, Ints32
from burrscan.axis.basis import perpendicular_basis, sensed
from burrscan.axis.fitting.ambiguity import undetermined
from burrscan.axis.fitting.covariance import AxisCovariance, covariance_of
from burrscan.axis.fitting.doubt import (
    ALIKE,
    gross_probability,
    independent_errors,
    off_probability,
    others,
    thickness,
)
from burrscan.axis.fitting.fit import FLOOR, Fit, refine
from burrscan.axis.fitting.ridges import SPACING
from burrscan.axis.fitting.scales import Thickness, thickness_of, unlikelihood
from burrscan.axis.fitting.sharpest import sharpest_place
from burrscan.axis.fitting.starts import candidate_axes
from burrscan.axis.points.cloud import Cloud, canonical_cloud, voxel_moments
from burrscan.axis.points.smooth import displacement, given_back, median_square_edge, smoothed, smoothed_cloud
from burrscan.axis.points.subdivide import subdivided
from burrscan.axis.points.surfels import surfels_of
from burrscan.axis.points.walls import off_walls
from burrscan.errors import InputError
from burrscan.inspection import Axis

BLUR = 0.02
"""Resolution of the generatrix in units of the rms radius, or coarser where the noise is larger."""
COARSE_BLUR = 0.05
"""The same while the start may be a degree off."""
BLUR_PER_SIGMA = 1.5
"""Least blur in noise deviations: pieces finer than the noise is thick would follow the noise."""
RIVAL, RIVAL_COST = 3.0, 0.02
"""A candidate is tried while its cost is below this many times the least, and some."""
CONTEST_STEPS = 6
"""Gauss-Newton steps when several starts differ: the three that each had were too few to tell them apart."""
FLAT = 0.01
"""Faces of a coarse mesh lie within the part by about this share of the rms radius, or less."""
LEAST_CORNERS = 0.5
"""Share of a coarse mesh's vertices that must lie on its generatrix to count as points of the part."""
SMOOTH = 0.25
"""Share of independent noise that two rounds of averaging over six neighbours leave."""
MOST_DOUBT = 1e-4
"""What is more probably another axis than this is refused. One bluff in a thousand is the goal, and parts
that no generatrix explains are rarer in the model than among parts: a vase of 0.00013 was 88 degrees off."""
MOST_OFF = 1e-3
"""What is more probably a degree off than this is not given as certain."""
DEGREE = "direction to 1 deg"
"""Left open where no other axis fits, but this one may be more than a degree off."""
HALF = 0.5
"""Of the median distance between points averaged once and those with that given back: most of their gap is
along the surface."""
MOST_WALLS = 0.85
"""With more walls than this a part has too little left to measure, and they stay."""
MOST_ROUND = 0.8
"""Share of inliers on the round side from which nothing else is tried: burrs and rounded edges take less."""
FINER = (1.0, 2.0, 4.0)
"""Resolutions that are tried there, over the usual one."""
ANNEALED = ((0.1, COARSE_BLUR), (0.03, 0.03), (0.01, BLUR))
"""Noise that is allowed for and resolution, one after the other, in rms radii: from what a start may be off
by to the noise of cells."""
ANNEALED_STEPS = 8
"""Gauss-Newton steps of each: five leave the axis on its way."""
SLOPE_NOISE = 0.015
"""A piece is long enough for its slope to be known this well, in radians."""


def find_axis_profile(
    vertices_mm: Floats,
    faces: Ints32 | None,
    *,
    sigma_mm: Floats | None = None,
    seed: int = 0,  # noqa: ARG001
    smoothing: int = 2,
    full_steps: int = 5,
    most_doubt: float = MOST_DOUBT,
) -> Axis:
    """Find the axis by fitting a free generatrix to all points.

    Parameters
    ----------
    vertices_mm, faces
        (V, 3) finite positions and (T, 3) indices.
    sigma_mm
        (V,) standard deviations; all alike where None.
    smoothing
        Rounds of averaging over neighbours before the fit.
    full_steps
        Most Gauss-Newton steps with all points; two or three do.
    most_doubt
        An axis that is another one with a higher probability than this is refused; 1 refuses none.

    Raises
    ------
    InputError
        When no axis fits, or others fit about as well; their directions and places are named.

    Notes
    -----
    O(V + T). An axis without rivals that may still be more than a degree off is given, and ``undetermined``
    says so.

    """
    cloud = canonical_cloud(vertices_mm, sigma_mm)
    raw, corners = cloud.points, None
    if faces is not None and len(faces) and sigma_mm is None:
        raw, faces = subdivided(cloud.points, faces)
        corners = None if raw is cloud.points else cloud.points
    pitch = 0.0
    if faces is not None and len(faces):
        smooth = smoothed(raw, cloud.weights, faces, rounds=smoothing)
        pitch = float(np.sqrt(median_square_edge(smooth, faces)))
        points = given_back(smooth, cloud.weights, faces, rounds=smoothing)
    else:
        smooth = points = smoothed_cloud(raw, rounds=smoothing)
    raw_sigma = displacement(raw, smooth) if smoothing else 0.0
    cells, rows = voxel_moments(smooth, cloud.weights)
    candidates, evaluations = candidate_axes(surfels_of(cells, rows))
    if not candidates:
        raise InputError(
            "no axis fits: the points hold no surface of revolution, or less than a patch of one"
        )
    means, counts = rows[:, 1:4] / rows[:, :1], rows[:, 0] / rows[:, 0].mean()
    fit, rivals = _best_start(means, counts, candidates)
    least = max(FLOOR, SMOOTH * stated_sigma(sigma_mm) / cloud.scale_mm)
    blur = resolution(fit, max(raw_sigma, fit.sigma), len(points), pitch)
    rough = refine(
        means, counts, fit.frame[:, 2], fit.place, blur=blur, steps=4, sigma=fit.sigma, least=least
    )
    blur = resolution(rough, max(raw_sigma, rough.sigma), len(points), pitch)
    if (
        points is not smooth and sigma_mm is None
    ):  # the two lie apart, on a surface without noise by more than its noise
        least = max(least, HALF * displacement(points, smooth))
    weightings = [cloud.weights, np.empty(0)] if len(cloud.weights) else [cloud.weights]
    if corners is None and pitch > 0.0 and faces is not None:
        noise = SMOOTH * raw_sigma / pitch
        kept = off_walls(smooth, faces, rough.frame[:, 2], rough.place, noise=noise)
        if 1.0 - MOST_WALLS < kept.mean() < 1.0:
            points, raw = points[kept], raw[kept]
            weightings = [weights[kept] if len(weights) else weights for weights in weightings]
    fits = [
        refine(
            points, weights, rough.frame[:, 2], rough.place,
            blur=blur, steps=full_steps, sigma=rough.sigma, raw_sigma=raw_sigma, thinned=(means, counts),
            least=least,
        )
        for weights in weightings
    ]  # fmt: skip
    if corners is not None:  # no noise is stated there, so that there is one fit
        fits[0], points, raw = _by_corners(fits[0], points, raw, corners, blur)
        seen = [(fits[0], thickness_of(points, fits[0]))]
    else:
        seen = [
            _where_likelier(points, weights, fit, (means, counts), blur=blur, steps=full_steps)
            for weights, fit in zip(weightings, fits, strict=True)
        ]
    stated = [
        (fit, covariance_of(points, raw, weights, fit, thick))
        for weights, (fit, thick) in zip(weightings, seen, strict=True)
    ]
    fit, known = min(stated, key=lambda one: log_covariance_determinant(one[1]))
    flags = undetermined(means, counts, cloud.points, cloud.weights, fit=fit, known=known)
    rivals = others(fit, rivals, float(counts.sum()))
    other = _other_probability(means, counts, fit, rivals, known=known, noise=SMOOTH * raw_sigma)
    off = off_probability(known.covariance[:2, :2], freedom=known.freedom)
    if off > MOST_OFF and "direction" not in flags:
        flags = (*flags, DEGREE)
    axis = axis_of(cloud, fit, known, evaluations + fit.steps, flags, doubt=other + (1.0 - other) * off)
    if other > most_doubt and "direction" not in flags:
        raise InputError(_refusal(axis, other, [_line(cloud, rival) for rival in rivals]))
    return axis


def _where_likelier(
    points: Floats, weights: Floats, fit: Fit, thinned: tuple[Floats, Floats], *, blur: float, steps: int
) -> tuple[Fit, Thickness]:
    """The fit, or one beside it where the generatrix is sharper, if its round side hardly fits here.

    A flat face that is seen well sets the noise, and a side with lugs or flutes then counts nearly nothing.
    Or two sheets, tops and bottoms of lugs or both sides of a thin wall, are too close for pieces as long as
    noise lets slopes be known: finer ones tell them apart.
    """
    here = thickness_of(points, fit)
    if here.round_share >= MOST_ROUND:
        return fit, here
    found = [(fit, here)]
    places = (
        fit.place,
        sharpest_place(*thinned, fit.frame, fit.place),
        _annealed(thinned[0], fit).place,
    )
    for place, finer in product(places, FINER):
        other = refine(
            points, weights, fit.frame[:, 2], place,
            blur=blur / finer, steps=steps, sigma=fit.sigma,
            raw_sigma=fit.raw_sigma, thinned=thinned, least=fit.least,
        )  # fmt: skip
        found.append((other, thickness_of(points, other)))
    return likeliest(found)


def likeliest(found: list[tuple[Fit, Thickness]]) -> tuple[Fit, Thickness]:
    """The fit that is likeliest, of those whose round side fits if there are any.

    That of points which are nearly all a face's hardly knows of the round side.
    """
    fitting = [one for one in found if one[1].round_share >= MOST_ROUND]
    return min(fitting or found, key=lambda one: unlikelihood(one[1], one[0]))


def _annealed(means: Floats, fit: Fit) -> Fit:
    """A fit to (M, 3) means of cells, each counting once, while the noise that is allowed for shrinks.

    Graduated non-convexity (Blake & Zisserman 1987): at first the round side counts, however far the start
    is off; by area it is more of the part than by points, of which a face that is seen squarely has most.
    """
    for sigma, blur in ANNEALED:
        fit = refine(
            means, np.empty(0), fit.frame[:, 2], fit.place,
            blur=blur, steps=ANNEALED_STEPS, sigma=sigma, least=fit.least,
        )  # fmt: skip
    return fit


def _other_probability(
    means: Floats, counts: Floats, fit: Fit, rivals: list[Fit], *, known: AxisCovariance, noise: float
) -> float:
    """Probability that a rival is the axis; ``noise`` is that of the smoothed points."""
    if not rivals:
        return 0.0
    total = float(counts.sum())
    alone = refine(means, counts, fit.frame[:, 2], fit.place, blur=BLUR, steps=2)
    errors = independent_errors(thickness=thickness(alone, total), noise=noise, points=known.independent)
    own, *those = (unlikelihood(thickness_of(means, one), one) for one in [alone, *rivals])
    return gross_probability(own, those, independent=errors)


def _refusal(axis: Axis, probability: float, rivals: list[tuple[Floats, Floats]]) -> str:
    """Why an axis is not given: what else it might be, and how probable that is."""
    first, *more = (
        f"({', '.join(f'{x:.4g}' for x in direction)}) through ({', '.join(f'{x:.4g}' for x in point)})"
        for point, direction in [(axis.point_mm, axis.direction), *rivals]
    )
    return (
        f"the axis is in doubt, {100.0 * probability:.2g} % that it is another one: the points "
        f"fit {first}, but also {', '.join(more)}; hand over more of the part or another view of it, without "
        "what is not round (or most_doubt = 1, to have the axis all the same)"
    )


def _by_corners(
    fit: Fit, points: Floats, raw: Floats, corners: Floats, blur: float
) -> tuple[Fit, Floats, Floats]:
    """The fit, points and raw points of a coarse mesh once its corners have the last word.

    Faces tell the slopes of the generatrix, but lie within the part; its corners lie on it.
    """
    alike = np.ones(len(corners))
    last = refine(
        points, np.empty(0), fit.frame[:, 2], fit.place,
        blur=blur, steps=0, sigma=max(fit.sigma, FLAT), thinned=(corners, alike),
    )  # fmt: skip
    if last.inliers < LEAST_CORNERS * len(corners):
        return fit, points, raw
    return last, corners, corners


def log_covariance_determinant(known: AxisCovariance) -> float:
    """Logarithm of the determinant of a fit's covariance, the square of its uncertainty ellipsoid's volume.

    Weights by the stated noise are best where errors are those of pixels alone. Errors that neighbours share
    (light that bounces, footprints on curved metal) are as large where the noise is small, and there such
    weights hand the axis to a few quiet places. Sectors of the part then disagree, and equal weights have the
    smaller determinant.
    """
    sign, volume = np.linalg.slogdet(known.covariance)
    return float(volume) if sign > 0.0 else np.inf


def stated_sigma(sigma_mm: Floats | None) -> float:
    """The standard deviation that weights of unit mean stand for; 0 where none is stated."""
    return 0.0 if sigma_mm is None else float(np.mean(sigma_mm**-2.0) ** -0.5)


def _best_start(
    means: Floats, counts: Floats, candidates: list[tuple[Floats, Floats, float]]
) -> tuple[Fit, list[Fit]]:
    """Refine the candidates that come near the best, at two resolutions; keep the thinnest generatrix.

    Besides, the fits that come near it.
    """
    rivals = [c for c in candidates if c[2] < RIVAL * candidates[0][2] + RIVAL_COST]
    fits = [
        refine(means, counts, direction, place, blur=blur, steps=3)
        for direction, place, _ in rivals
        for blur in (COARSE_BLUR, BLUR)
    ]
    total = float(counts.sum())
    limit = RIVAL * min(thickness(fit, total) for fit in fits)
    contest = [fit for fit in fits if thickness(fit, total) <= limit]
    if not contest:
        return fits[0], []
    best = min(contest, key=lambda fit: thickness(fit, total))
    if all(abs(fit.frame[:, 2] @ best.frame[:, 2]) > ALIKE for fit in contest):
        return best, contest
    # Seen from the side a gear is nearly a prism: a few steps more tell which start leads to the thinner one.
    longer = [
        refine(means, counts, fit.frame[:, 2], fit.place, blur=BLUR, steps=CONTEST_STEPS) for fit in contest
    ]
    return min([best, *longer], key=lambda fit: thickness(fit, total)), longer


def resolution(fit: Fit, raw_sigma: float, count: int, pitch: float) -> float:
    """Blur of the pieces: as fine as noise lets slopes be known, σ √12 / (L √n) with n = λ L points."""
    density = count / max(len(fit.coefficients) * fit.pieces.spacing, 1e-300)
    length = (raw_sigma * np.sqrt(12.0 / density) / SLOPE_NOISE) ** (2.0 / 3.0)
    return max(BLUR, BLUR_PER_SIGMA * fit.sigma, float(length) / SPACING, min(pitch, COARSE_BLUR))


def _line(cloud: Cloud, fit: Fit) -> tuple[Floats, Floats]:
    """Point and direction of a fit in the frame of the mesh."""
    direction = cloud.rotation @ fit.frame[:, 2]
    along = float(fit.frame[:, 2] @ fit.place)
    point = cloud.mean_mm + cloud.scale_mm * (cloud.rotation @ (fit.place - along * fit.frame[:, 2]))
    return point, sensed(direction / np.linalg.norm(direction))


def axis_of(
    cloud: Cloud,
    fit: Fit,
    known: AxisCovariance,
    evaluations: int,
    flags: tuple[str, ...],
    *,
    doubt: float = float("nan"),
) -> Axis:
    """Turn a fit in the canonical frame into an axis in the frame of the mesh."""
    point, direction = _line(cloud, fit)
    along = float(fit.frame[:, 2] @ fit.place)
    change = perpendicular_basis(direction).T @ cloud.rotation @ fit.frame[:, :2]
    move = np.eye(4)
    move[2, 1], move[3, 0] = -along, along  # the offset at the stated point, not at the fit's own
    turn = np.zeros((4, 4))
    turn[:2, :2], turn[2:, 2:] = change, cloud.scale_mm * change
    covariance = turn @ move @ known.covariance @ move.T @ turn.T
    for flag, part, size in (
        ("direction", slice(0, 2), np.pi / 2),
        ("position", slice(2, 4), cloud.scale_mm),
    ):
        if flag in flags:
            covariance[part, :] = covariance[:, part] = 0.0
            covariance[part, part] = size**2 * np.eye(2)
    return Axis(point, direction, covariance, "profile", evaluations, flags, doubt)
