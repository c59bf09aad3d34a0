"""Poses, axis and curve of several views as one least-squares problem.

A surface of revolution does not tell how a view is turned about its axis, and a view of a third of it tells
only so much of where the axis is: place across and radius go together. Views that share one curve help each
other there, whatever the robot's accuracy; views aligned by their distances alone
(:mod:`burrscan.registration.align`) hand the errors of their poses on to the axis. So everything is unknown
at once: per view a pose, which the robot's word holds where nothing else does (Lu & Milios 1997 for poses
with priors); the part's axis in the robot's frame; and the curve, which is eliminated in every step (variable
projection; Golub & Pereyra 1973, Kaufman 1975).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from burrscan.arrays import Bools, Floats
from burrscan.axis.api import find_axis
from burrscan.axis.basis import T_part_mesh, sensed
from burrscan.axis.fitting.fit import TUKEY
from burrscan.axis.fitting.ridges import Pieces
from burrscan.errors import InputError
from burrscan.generatrix.curve import fit_generatrix
from burrscan.inspection import Axis, Generatrix
from burrscan.pose import exponential, placed, rigid
from burrscan.registration.alignment import PosedSurface
from burrscan.registration.joined.curve import curve_at, inverses_of, pieces_of
from burrscan.registration.joined.motion import axis_at
from burrscan.registration.joined.points import UNKNOWNS, Rows, rows_of, sector_pulls
from burrscan.registration.joined.robot import BASE, base_covariance, base_motion, robot_rows
from burrscan.registration.joined.roll import bins_of, height_map, roll_rows
from burrscan.registration.joined.types import Joint, PosePrior
from burrscan.registration.scale import scale_of
from burrscan.robust import SIGMA_PER_MEDIAN

__all__ = ["Joint", "PosePrior", "joint"]

_FEWEST = 300
"""Points of a view: with fewer a curve and a pose cannot be told apart."""
_THINNED = 6_000
"""Points of a view for its first axis and first steps, which need not be good."""
_BLURS = (0.06, 0.02)
"""Resolutions of the curve in units of the part's rms radius: the first bears the robot's errors."""
_BLUR_PER_SIGMA = 1.5
"""Least resolution in noise deviations, as in :mod:`burrscan.axis.profile`."""
_EFFICIENCY = 0.961
"""Of Tukey's weights on normal noise at that limit (Holland & Welsch 1977)."""
_STEPS = 32
"""Of Gauss-Newton per resolution; five do."""
_WHOLE = 10
"""Of them, then half ones: points that change from one piece to the next make whole ones oscillate."""
_SETTLED = 0.2
"""Done when the poses move by less than this share of their standard deviations: points that change from one
piece, or one bin, to the next shake them by some tenths."""
_FALLS = 0.5
"""Share of it that a view's noise falls to in a step at most (graduated non-convexity; Blake & Zisserman,
Visual Reconstruction, 1987): a face that fits at once would shut out the walls, which are not there yet."""
_ALONG = 5
"""Which of a view's unknowns is its place along the axis."""
_LEAST_USED = 0.5
"""Share of a view's points on the curve: with less, most of it is another part, or not round."""
_UNLIKE = 10.0
"""Times the median view's residuals in stated ones: one that fits so much worse is no view of this part."""
_LOST = 8.0
"""Standard deviations of the robot's word; its errors are not normal, so few would refuse good views."""
_MOVES = 0.2
"""Motion in a step, in noise deviations of a point, above which the search has not ended."""
_UNSETTLED = 1.0
"""Standard deviations: a last step of that size was not the last one."""
_LEAST_SPREAD = 1e-6
"""In stated standard deviations: surfaces without noise."""


@dataclass
class _State:
    """What changes from step to step: poses in the part frame, the part in the world, curve and noise."""

    poses: Floats
    T_world_part: Floats
    pieces: Pieces
    coefficients: Floats
    spread: Floats


def joint(
    views: Sequence[PosedSurface],
    *,
    prior: PosePrior = PosePrior(),  # noqa: B008 (frozen)
    use_roll: bool = True,
) -> Joint:
    """Estimate poses, axis and curve of views of one part of revolution together.

    Parameters
    ----------
    views
        One or more, with the poses that the robot reported. Where a view states no standard deviation of its
        vertices, the noise that they show is taken.
    prior
        How good the reported poses are.
    use_roll
        Whether what is not round may turn views about the axis.

    Raises
    ------
    InputError
        For no views, views of hardly any points, poses that are no rigid motions, points that hold no axis,
        views that do not share a curve with the others, and where the search does not end.

    Notes
    -----
    Residuals are distances off the curve along its normal, Tukey's biweight; the curve is made of parabolas,
    as in :mod:`burrscan.axis.fitting.fit`. The covariance is that of the joint normal matrix, with the noise
    that the residuals show and widened where points of one sector err together. Invariant under a motion of
    the world and, but for rounding, the order of the views. O(V) per step.

    """
    if not views:
        raise InputError("no views: the joint estimate needs one at least")
    points, sigma = _points(views)
    reported = np.stack([rigid(v.T_world_camera, what=f"view {n}") for n, v in enumerate(views, 1)])
    state = _start(points, reported)
    size = _rms_radius(points, reported, state.T_world_part)
    steps = 0
    state.spread = np.maximum(_rough_mm(points, prior) / [float(np.median(s)) for s in sigma], 1.0)
    for fine in (False, True):
        every = 1 if fine else max(1, sum(map(len, points)) // (_THINNED * len(points)))
        some, noise = [p[::every] for p in points], [s[::every] for s in sigma]
        middle = float(np.median([k * np.median(s) for k, s in zip(state.spread, noise, strict=True)]))
        resolution = max(_BLURS[fine] * size, _BLUR_PER_SIGMA * middle if fine else 0.0)
        state.pieces = pieces_of(some, state.poses, resolution)
        state.coefficients = np.zeros((len(state.pieces.centre), 3))
        for number in range(_STEPS):
            steps += 1
            share = 1.0 if number < _WHOLE else 0.5
            before = state.spread
            moved, moved_mm = _step(
                state, some, noise, reported, prior, size, share=share, fine=fine, use_roll=use_roll and fine
            )
            if moved < _SETTLED and (state.spread > _FALLS * before).all():
                break
    _refuse_apart(state, points, sigma, prior)
    _refuse_foreign(state, points, sigma)
    _refuse_lost(state, points, reported, prior)
    if moved > _UNSETTLED:
        if moved_mm > _MOVES * middle:
            raise InputError(
                f"the poses still move by {moved_mm:.2g} mm a step: give better reported poses, or state the "
                "prior's sigma as it is"
            )
        # many points make the stated deviations smaller than the last steps, which are far below the noise
        state.spread = state.spread * moved
    return _result(state, views, points, sigma, reported, prior, steps, use_roll=use_roll)


def _refuse_apart(state: _State, points: list[Floats], sigma: list[Floats], prior: PosePrior) -> None:
    """Refuse views whose points lie farther off their best curve than the robot's errors could put them."""
    noise = state.spread * [float(np.median(s)) for s in sigma]
    said = float(np.median(_rough_mm(points, prior)))
    if np.median(state.spread) > _UNLIKE and np.median(noise) > said:
        raise InputError(
            f"the views share no curve: their points lie {np.median(noise):.2g} mm off the best one, where "
            f"their reported poses are stated to put them {said:.2g} mm off at most: check every reported "
            "pose, and that all views show the same part"
        )


def _refuse_foreign(state: _State, points: list[Floats], sigma: list[Floats]) -> None:
    """Refuse views that are not of the curve that the others share."""
    for number, row in enumerate(_rows(state, points, sigma, robust=True, shared=False), 1):
        share = float(np.mean(np.abs(row.z) < TUKEY))
        if not share > _LEAST_USED:
            raise InputError(
                f"view {number}: only {100.0 * share:.0f} % of its points lie on the curve that all views "
                "share: check that it shows the same part, its reported pose, and the prior's sigma"
            )
    middle = np.median(state.spread)
    for number, (spread, stated) in enumerate(zip(state.spread, sigma, strict=True), 1):
        if not spread < _UNLIKE * max(float(middle), 1.0):
            raise InputError(
                f"view {number}: its points are {spread * float(np.median(stated)):.2g} mm off the curve "
                f"that all views share, {spread:.0f} times what is stated of them: check that it shows the "
                "same part, and its reported pose"
            )


def _refuse_lost(state: _State, points: list[Floats], reported: Floats, prior: PosePrior) -> None:
    """Refuse views that came to lie far from where the robot said, as far as it is said to be accurate."""
    for number, (own, pose, said) in enumerate(zip(points, state.poses, reported, strict=True), 1):
        middle = np.append(own.mean(axis=0), 1.0)
        away = float(np.linalg.norm((state.T_world_part @ pose @ middle - said @ middle)[:3]))
        lever = np.radians(prior.sigma_deg) * _lever_mm(own)
        if away > _LOST * np.sqrt(3.0) * float(np.hypot(prior.sigma_mm, lever)):
            raise InputError(
                f"view {number}: it fits {away:.1f} mm from its reported pose, which is stated to "
                f"{prior.sigma_mm:g} mm and {prior.sigma_deg:g} deg: check that pose, or the prior's sigma"
            )


def _rough_mm(points: list[Floats], prior: PosePrior) -> Floats:
    """(N,) how far a view's points may lie off by its reported pose: a turn acts over their distance."""
    return np.array([prior.sigma_mm + np.radians(prior.sigma_deg) * _lever_mm(own) for own in points])


def _lever_mm(own: Floats) -> float:
    """Distance of a view's points from the origin of its frame."""
    return float(np.linalg.norm(own.mean(axis=0)))


def _points(views: Sequence[PosedSurface]) -> tuple[list[Floats], list[Floats]]:
    """Finite points and their standard deviations."""
    points, sigma = [], []
    for number, view in enumerate(views, 1):
        good: Bools = np.asarray(np.isfinite(view.vertices_mm).all(axis=1))
        if good.sum() < _FEWEST:
            raise InputError(f"view {number}: {good.sum()} points are too few, at least {_FEWEST} are needed")
        own = np.ascontiguousarray(view.vertices_mm[good])
        stated = view.sigma_mm[good]
        if not (np.isfinite(stated) & (stated > 0.0)).all():
            measured = scale_of(own, cKDTree(own), np.random.default_rng(0)).noise_mm
            stated = np.where(np.isfinite(stated) & (stated > 0.0), stated, measured)
        points.append(own)
        sigma.append(np.ascontiguousarray(stated))
    return points, sigma


def _start(points: list[Floats], reported: Floats) -> _State:
    """The axis that most views agree on, each by itself and put into the world by its reported pose."""
    found, refused = [], []
    for own, pose in zip(points, reported, strict=True):
        try:
            axis = find_axis(own[:: -(-len(own) // _THINNED)])
        except InputError as error:
            refused.append(error)
            continue
        found.append((pose[:3, :3] @ axis.point_mm + pose[:3, 3], pose[:3, :3] @ axis.direction))
    if not found:
        raise refused[0]
    directions = np.array([direction for _, direction in found])
    best = int(np.argmax(np.median(np.abs(directions @ directions.T), axis=1)))
    point, direction = found[best]
    T_part_world = T_part_mesh(point, sensed(direction))
    T_part_world[2, 3] -= float(T_part_world[2, :3] @ point + T_part_world[2, 3])
    empty = Pieces(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros((0, 0), np.int16), np.zeros(2), 1.0, 1.0)
    return _State(
        poses=T_part_world @ reported,
        T_world_part=np.asarray(np.linalg.inv(T_part_world)),
        pieces=empty,
        coefficients=np.zeros((0, 3)),
        spread=np.ones(len(points)),
    )


def _rms_radius(points: list[Floats], reported: Floats, T_world_part: Floats) -> float:
    """RMS distance of the points from their mean."""
    back = np.linalg.inv(T_world_part)
    together = np.concatenate(
        [placed(back @ pose, p[::10]) for p, pose in zip(points, reported, strict=True)]
    )
    off = together - np.median(together, axis=0)
    return float(np.sqrt(np.median((off**2).sum(axis=1))))


def _rows(
    state: _State, points: list[Floats], sigma: list[Floats], *, robust: bool, shared: bool
) -> list[Rows]:
    curve = curve_at(state.pieces, state.coefficients)
    return [
        rows_of(p, s * k, np.ascontiguousarray(pose), curve, TUKEY, robust=robust, shared=shared)
        for p, s, k, pose in zip(points, sigma, state.spread, state.poses, strict=True)
    ]


def _eliminated(rows: list[Rows], inverse: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Normal equations of all poses without the curve; the curve's offset and its response to the poses."""
    count = len(rows)
    slopes = np.concatenate([row.sums[:, :3, 3:-1] for row in rows], axis=2)  # (K, 3, 6N)
    offset = np.einsum("kij,kj->ki", inverse, np.sum([row.sums[:, :3, -1] for row in rows], axis=0))
    response = inverse @ slopes
    square, pull = np.zeros((UNKNOWNS * count,) * 2), np.zeros(UNKNOWNS * count)
    for number, row in enumerate(rows):
        block = slice(UNKNOWNS * number, UNKNOWNS * number + UNKNOWNS)
        total = row.sums[:, 3:-1, 3:].sum(axis=0)
        square[block, block], pull[block] = total[:, :-1], total[:, -1]
    square -= np.einsum("kia,kib->ab", slopes, response, optimize=True)
    pull -= np.einsum("kia,ki->a", slopes, offset)
    return *_slid(square, pull), offset, response


def _slid(square: Floats, pull: Floats) -> tuple[Floats, Floats]:
    """The same without what it says of all views' common place along the axis: the curve may lie anywhere.

    Pieces are expected to be straight, a little, and so feign to know it.
    """
    along = np.zeros(len(pull))
    along[_ALONG::UNKNOWNS] = 1.0
    drawn = square @ along
    told = float(along @ drawn)
    if told <= 0.0:
        return square, pull
    return square - np.outer(drawn, drawn) / told, pull - drawn * float(along @ pull) / told


def _system(
    state: _State,
    points: list[Floats],
    square: Floats,
    pull: Floats,
    noise_mm: Floats,
    robot: tuple[Floats, Floats],
    *,
    use_roll: bool,
) -> tuple[Floats, Floats, Floats]:
    """The whole normal matrix and pull: points, robot, and what is not round; and the last one's diagonal."""
    count = len(points)
    whole, wanted = robot[0].copy(), robot[1].copy()
    whole[: UNKNOWNS * count, : UNKNOWNS * count] += square
    wanted[: UNKNOWNS * count] += pull
    seen = np.zeros(count)
    if use_roll and count > 1:
        curve = curve_at(state.pieces, state.coefficients)
        bins = bins_of(curve, sum(map(len, points)) / count)
        maps = [
            height_map(p, np.ascontiguousarray(pose), curve, bins=bins)
            for p, pose in zip(points, state.poses, strict=True)
        ]
        told, turn = roll_rows(maps, noise_mm)
        rolls = UNKNOWNS * np.arange(count) + 2
        whole[np.ix_(rolls, rolls)] += told
        wanted[rolls] += turn
        seen = np.diag(told)
    return whole, wanted, seen


def _step(
    state: _State,
    points: list[Floats],
    sigma: list[Floats],
    reported: Floats,
    prior: PosePrior,
    size_mm: float,
    *,
    share: float,
    fine: bool,
    use_roll: bool,
) -> tuple[float, float]:
    """A share of a Gauss-Newton step, in place: the step's length in standard deviations per unknown, and mm.

    The length in mm is that of the largest motion across the axis at ``size_mm`` from the middle: along and
    about the axis a round part slides. What points share is looked at where poses are ``fine``: before that
    it is the poses' errors.
    """
    rows = _rows(state, points, sigma, robust=True, shared=fine)
    inverse = inverses_of(rows, state.pieces.spacing)
    square, pull, offset, response = _eliminated(rows, inverse)
    noise = np.array([k * float(np.median(s)) for k, s in zip(state.spread, sigma, strict=True)])
    robot = robot_rows(reported, state.poses, state.T_world_part, prior)
    whole, wanted, _ = _system(state, points, square, pull, noise, robot, use_roll=use_roll)
    step: Floats = np.asarray(-np.linalg.solve(whole, wanted), dtype=float)
    views, base = share * step[:-BASE], share * step[-BASE:]
    state.coefficients = state.coefficients + share * offset + response @ views
    state.poses = np.stack(
        [
            exponential(twist) @ pose
            for twist, pose in zip(views.reshape(-1, UNKNOWNS), state.poses, strict=True)
        ]
    )
    state.T_world_part = state.T_world_part @ exponential(base_motion(base))
    state.spread = np.array(
        [max(_spread(row.z, k), _FALLS * k) for row, k in zip(rows, state.spread, strict=True)]
    )
    twists = step[:-BASE].reshape(-1, UNKNOWNS)
    across = np.abs(np.concatenate([twists[:, :2] * size_mm, twists[:, 3:5]], axis=1)).max()
    return float(np.sqrt(step @ whole @ step / len(step))), float(across)


def _spread(z: Floats, spread: float) -> float:
    """Standard deviation of a view's residuals in stated ones, robustly."""
    size = np.abs(z[np.isfinite(z)])
    return float(max(spread * SIGMA_PER_MEDIAN * np.median(size), _LEAST_SPREAD)) if len(size) else spread


def _result(
    state: _State,
    views: Sequence[PosedSurface],
    points: list[Floats],
    sigma: list[Floats],
    reported: Floats,
    prior: PosePrior,
    steps: int,
    *,
    use_roll: bool,
) -> Joint:
    """What was found, with the covariance of the joint normal matrix."""
    count = len(views)
    rows = _rows(state, points, sigma, robust=False, shared=True)
    *_, response = _eliminated(rows, inverses_of(rows, state.pieces.spacing))
    wide = _widened(state, points, sigma, rows, response) / _EFFICIENCY
    rows = [row._replace(sums=row.sums / factor) for row, factor in zip(rows, wide, strict=True)]
    square, pull, *_ = _eliminated(rows, inverses_of(rows, state.pieces.spacing))
    noise = np.array([k * float(np.median(s)) for k, s in zip(state.spread, sigma, strict=True)])
    robot = robot_rows(reported, state.poses, state.T_world_part, prior)
    whole, _, seen = _system(state, points, square, pull, noise, robot, use_roll=use_roll)
    covariance: Floats = np.asarray(np.linalg.inv(whole))
    z = [_middle(p, pose, row.z) for p, pose, row in zip(points, state.poses, rows, strict=True)]
    part = _world_axis(state, covariance, float(np.mean(z)), steps)
    poses = state.T_world_part @ state.poses
    return Joint(
        T_world_camera=poses,
        covariance=_world_covariance(state, covariance),
        middle_mm=state.T_world_part[:3, 3],
        axis=part,
        axes_camera=tuple(
            axis_at(np.linalg.inv(pose), _block(covariance, n), middle, evaluations=steps)
            for n, (pose, middle) in enumerate(zip(state.poses, z, strict=True))
        ),
        generatrix=_common_curve(views, poses, part, sigma),
        noise_mm=noise,
        used=np.array([float(np.mean(np.abs(row.z) < TUKEY)) for row in rows]),
        roll_sigma_deg=_roll_sigma_deg(covariance, count),
        roll_seen=seen > 0.0,
        iterations=steps,
    )


def _common_curve(
    views: Sequence[PosedSurface], poses: Floats, axis: Axis, sigma: list[Floats]
) -> Generatrix:
    """The curve of all views' points; their faces tell which side of it is air."""
    clouds = [placed(pose, view.vertices_mm) for view, pose in zip(views, poses, strict=True)]
    first = np.cumsum([0, *(len(cloud) for cloud in clouds[:-1])])
    faces = [view.faces + start for view, start in zip(views, first, strict=True)]
    try:
        return fit_generatrix(
            np.concatenate(clouds),
            np.concatenate(faces).astype(np.int32),
            axis,
            sigma_mm=np.concatenate(sigma),
        )
    except InputError as error:
        raise InputError(
            "the views' points gather along no common curve: check that all show the same part, each view's "
            "reported pose, and the prior's sigma"
        ) from error


def _widened(
    state: _State, points: list[Floats], sigma: list[Floats], rows: list[Rows], response: Floats
) -> Floats:
    """(N,) by how much points of one sector that err together widen a view's variance, at least 1."""
    curve = curve_at(state.pieces, state.coefficients)
    wide = np.ones(len(points))
    for number, (p, s, row) in enumerate(zip(points, sigma, rows, strict=True)):
        own = np.ascontiguousarray(response[:, :, UNKNOWNS * number : UNKNOWNS * (number + 1)])
        pose = np.ascontiguousarray(state.poses[number])
        pulls, square = sector_pulls(p, s * state.spread[number], pose, curve, TUKEY, row.shares, own)
        told = [0, 1, 3, 4, 5]  # all but the turn about the axis
        inverse = np.linalg.pinv(square[np.ix_(told, told)], hermitian=True)
        filled = int(np.count_nonzero(pulls.any(axis=1)))
        lost = filled / max(filled - len(told), 1) / len(told)
        excess = float(np.trace(inverse @ pulls[:, told].T @ pulls[:, told]))
        wide[number] = max(1.0, lost * excess)
    return wide


def _middle(points: Floats, pose: Floats, z: Floats) -> float:
    """Mean place along the axis of what lies on the curve."""
    return float((points[np.isfinite(z)] @ pose[2, :3] + pose[2, 3]).mean())


def _block(covariance: Floats, number: int) -> Floats:
    own = slice(UNKNOWNS * number, UNKNOWNS * number + UNKNOWNS)
    return covariance[own, own]


def _world_axis(state: _State, covariance: Floats, z_mm: float, steps: int) -> Axis:
    base = base_covariance(covariance[-BASE:, -BASE:])
    return axis_at(state.T_world_part, base, z_mm, evaluations=steps)


def _world_covariance(state: _State, covariance: Floats) -> Floats:
    """(6N, 6N) of the poses in the world: each is off by the part's twist and by its own."""
    count = len(state.poses)
    turn = np.kron(np.eye(2), state.T_world_part[:3, :3])
    by = np.zeros((UNKNOWNS * count, UNKNOWNS * count + BASE))
    for number in range(count):
        block = slice(UNKNOWNS * number, UNKNOWNS * (number + 1))
        by[block, block] = turn
        by[block, -BASE:] = turn @ np.stack([base_motion(one) for one in np.eye(BASE)], axis=1)
    return np.asarray(by @ covariance @ by.T)


def _roll_sigma_deg(covariance: Floats, count: int) -> Floats:
    rolls = UNKNOWNS * np.arange(count) + 2
    own = covariance[np.ix_(rolls, rolls)]
    variance = np.diag(own) + own[0, 0] - 2.0 * own[0]
    return np.asarray(np.degrees(np.sqrt(np.maximum(variance, 0.0))))
