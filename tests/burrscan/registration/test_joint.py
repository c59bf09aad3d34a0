"""Poses, axis and curve together: against the bound, against one view alone, against the truth."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.interpolate import BSpline
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from burrscan.arrays import Floats
from burrscan.axis.basis import perpendicular_basis
from burrscan.errors import InputError
from burrscan.generatrix import deviation_mm
from burrscan.inspection import Axis
from burrscan.pose import placed
from burrscan.registration.alignment import PosedSurface
from burrscan.registration.joint import Joint, PosePrior, joint
from tests.burrscan.registration.turned import ARC_DEG, HALF_MM, Shot, bosses, radius, shot
from tests.burrscan.registration.views import motion, true_pose
from tests.tiers import some_of

SHAPE = (120, 60)
COUNTS = (1, 2, 4, 8)
DRAWS = {1: 40, 2: 30, 4: 12, 8: 10}
"""Each view of a draw has noise of its own: 40 to 80 axes for each number of views."""
SIGMA_MM = 0.02
KNOT_MM = 3.0
"""Distance of the knots of the bound's curve, which is as free as the one that is fitted."""


def turns(count: int) -> list[float]:
    return [k * (90.0 if count == 2 else 360.0 / count) for k in range(count)]


def axis_error(axis: Axis, T_world_camera: Floats) -> Floats:
    """(4,) tilts and offsets of a stated axis against the world's z axis, in the order of its covariance."""
    back = np.linalg.inv(T_world_camera)
    true = back[:3, 2] * np.sign(back[:3, 2] @ axis.direction)
    basis = perpendicular_basis(axis.direction)
    turn = np.cross(true, axis.direction)
    foot = back[:3, 3] + true * ((axis.point_mm - back[:3, 3]) @ axis.direction) / (true @ axis.direction)
    return np.concatenate([turn @ basis, (axis.point_mm - foot) @ basis])


def off_curve(points: Floats, twist: Floats) -> Floats:
    """Distance of moved points from the true curve along its normal, to first order; no code of burrscan."""
    moved = points @ motion(np.degrees(twist[:3]), twist[3:])[:3, :3].T + twist[3:]
    z = moved[:, 2]
    slope = (radius(z + 1e-4) - radius(z - 1e-4)) / 2e-4
    return (np.hypot(moved[:, 0], moved[:, 1]) - radius(z)) / np.hypot(1.0, slope)


def bound_deg(count: int, *, robot_mm: float = 0.5, robot_deg: float = 0.2) -> Floats:
    """(count,) Cramér-Rao bound of the axis in each camera: root of the sum of its two tilts' variances.

    By finite differences of a known profile with a free spline on it; unknown are all poses against the part,
    and the part's axis in the robot's frame, which the robot's errors tie together.
    """
    knots = np.arange(-HALF_MM - 3 * KNOT_MM, HALF_MM + 4 * KNOT_MM, KNOT_MM)
    splines = len(knots) - 4
    size = 6 * count + 4 + splines
    information = np.zeros((size, size))
    curve = slice(6 * count + 4, size)
    for number, turn in enumerate(turns(count)):
        phi, z = (
            grid.ravel()
            for grid in np.meshgrid(
                np.radians(turn + np.linspace(-ARC_DEG / 2, ARC_DEG / 2, SHAPE[0])),
                np.linspace(-HALF_MM, HALF_MM, SHAPE[1]),
                indexing="ij",
            )
        )
        flat = bosses(phi, z) < 1e-3
        phi, z = phi[flat], z[flat]
        points = np.stack([radius(z) * np.cos(phi), radius(z) * np.sin(phi), z], axis=1)
        rows = np.zeros((len(points), size))
        for k in range(6):
            step = np.zeros(6)
            step[k] = 1e-4
            rows[:, 6 * number + k] = (off_curve(points, step) - off_curve(points, -step)) / 2e-4
        slope = (radius(z + 1e-4) - radius(z - 1e-4)) / 2e-4
        basis = BSpline.design_matrix(np.clip(z, knots[3], knots[-4] - 1e-9), knots, 3).toarray()
        rows[:, curve] = -basis / np.hypot(1.0, slope)[:, None]
        information += rows.T @ rows / SIGMA_MM**2
        place = true_pose(turn)[:3, 3]
        told = np.zeros((6, size))
        for k in range(6):  # where the camera goes and how it turns when the view or the part moves
            step = np.zeros(6)
            step[k] = 1e-5
            ends = [
                np.concatenate(
                    [s * step[:3], motion(np.degrees(s * step[:3]), s * step[3:])[:3] @ [*place, 1.0]]
                )
                for s in (1.0, -1.0)
            ]
            told[:, 6 * number + k] = (ends[0] - ends[1]) / 2e-5
        told[:, 6 * count : 6 * count + 4] = told[:, 6 * number + np.array([0, 1, 3, 4])]
        weight = np.repeat([np.radians(robot_deg), robot_mm], 3) ** -2.0
        information += (told.T * weight) @ told
    covariance = np.linalg.inv(information + 1e-9 * np.eye(size))
    tilts = [covariance[6 * n, 6 * n] + covariance[6 * n + 1, 6 * n + 1] for n in range(count)]
    return np.degrees(np.sqrt(tilts))


@cache
def solved(count: int, seed: int) -> tuple[Shot, Joint]:
    """One shot: the same part and poses, seen by ever more views."""
    one = shot(turns(count), seed, shape=SHAPE)
    return one, joint(one.views)


def found(count: int) -> list[tuple[Shot, Joint]]:
    """All shots of so many views."""
    return [solved(count, seed) for seed in range(DRAWS[count])]


def camera_errors(shots: list[tuple[Shot, Joint]]) -> Floats:
    """(shots, views, 4)."""
    return np.array(
        [[axis_error(a, T) for a, T in zip(f.axes_camera, s.true, strict=True)] for s, f in shots]
    )


@pytest.mark.study
@pytest.mark.parametrize("count", COUNTS)
def test_the_axis_is_within_1_3_of_the_bound(count: int) -> None:
    """RMS over the draws and all views; chance alone makes up to 1.1 of 1 (two sigma of 80 tilts)."""
    tilts = np.degrees(camera_errors(found(count))[:, :, :2])
    rms = np.sqrt((tilts**2).sum(axis=2).mean())
    assert rms < 1.3 * np.sqrt((bound_deg(count) ** 2).mean())


def with_a_corner(one: Shot, rng: np.random.Generator) -> Shot:
    """A band of 4 mm in which the points of every 5.6 degrees err together, by three times their noise."""
    views = []
    for view, pose in zip(one.views, one.true, strict=True):
        at = placed(pose, view.vertices_mm)
        sector = (np.arctan2(at[:, 1], at[:, 0]) / (2.0 * np.pi) % 1.0 * 64).astype(int)
        shift = 3.0 * SIGMA_MM * rng.normal(size=64)[sector] * (np.abs(at[:, 2] - 10.0) < 2.0)
        at[:, :2] *= 1.0 + (shift / np.hypot(at[:, 0], at[:, 1]))[:, None]
        views.append(replace(view, vertices_mm=placed(np.linalg.inv(pose), at)))
    return replace(one, views=views)


def test_a_corner_whose_points_err_together_does_not_turn_the_axis() -> None:
    """It holds a twelfth of the points; were they taken to err by themselves the axis would be 4 times off.

    The mean over 24 tilts chance makes up to 1.3 of 1 (two sigma), and what is stated of 12 axes 0.6 to 1.4.
    """
    solved = [
        (one, joint(one.views))
        for seed in range(6)
        for one in [with_a_corner(shot(turns(2), seed, shape=SHAPE), np.random.default_rng(seed))]
    ]
    tilts = np.degrees(camera_errors(solved)[:, :, :2])
    assert np.sqrt((tilts**2).sum(axis=2).mean()) < 1.3 * 1.3 * np.sqrt((bound_deg(2) ** 2).mean())
    square = [
        e @ np.linalg.solve(a.covariance, e)
        for one, f in solved
        for a, T in zip(f.axes_camera, one.true, strict=True)
        for e in [axis_error(a, T)]
    ]
    assert 0.5 < np.mean(square) / 4.0 < 1.6


@pytest.mark.study
def test_more_views_make_the_axis_better_than_the_best_single_one() -> None:
    rms = [np.sqrt((camera_errors(found(count))[:, :, :2] ** 2).sum(axis=2).mean()) for count in COUNTS]
    shots = found(4)
    alone = np.array(
        [
            [axis_error(joint([v]).axes_camera[0], T)[:2] for v, T in zip(s.views, s.true, strict=True)]
            for s, _ in shots
        ]
    )
    single = np.sqrt((alone**2).sum(axis=2).mean(axis=0))  # per place of the camera
    together = np.sqrt((camera_errors(shots)[:, :, :2] ** 2).sum(axis=2).mean(axis=0))
    assert np.sqrt(np.mean(together**2)) < 0.85 * np.sqrt(np.mean(single**2))
    assert together.max() < 1.1 * single.min()  # twelve draws know an rms to 14 %
    assert rms[-1] < 0.75 * rms[0]
    assert rms == sorted(rms, reverse=True)


@pytest.mark.study
@pytest.mark.parametrize("count", COUNTS)
def test_stated_axes_hold_95_of_100_times(count: int) -> None:
    """Four numbers of each axis, in the cameras and in the world: chi-squared, and its 95 % point."""
    square = [
        e @ np.linalg.solve(a.covariance, e)
        for s, f in found(count)
        for a, T in zip(f.axes_camera, s.true, strict=True)
        for e in [axis_error(a, T)]
    ]
    held = np.mean(np.array(square) < chi2.ppf(0.95, 4))
    # views of one shot share errors: what counts are the shots, at least
    assert held > 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / len(found(count)))
    assert 4.0 / 2.2 < np.mean(square) < 4.0 * 1.8
    world = [axis_error(f.axis, np.eye(4)) for _, f in found(count)]
    square = [
        e @ np.linalg.solve(f.axis.covariance, e) for e, (_, f) in zip(world, found(count), strict=True)
    ]
    assert chi2.ppf(1e-4, 4 * len(square)) < np.sum(square) < chi2.ppf(1 - 1e-4, 4 * len(square))


def relative(poses: Floats) -> Floats:
    return np.stack([np.linalg.inv(poses[0]) @ pose for pose in poses])


def rolls_deg(shots: list[tuple[Shot, Joint]]) -> Floats:
    """Errors over their stated sigma of every turn about the axis against the first view."""
    pulls = []
    for s, f in shots:
        for k in range(1, len(s.true)):
            off = relative(f.T_world_camera)[k] @ np.linalg.inv(relative(np.array(s.true))[k])
            about = s.true[0] @ off @ np.linalg.inv(s.true[0])
            turn = np.degrees(Rotation.from_matrix(about[:3, :3]).as_rotvec()[2])
            pulls.append(turn / f.roll_sigma_deg[k])
    return np.array(pulls)


@pytest.mark.study
def test_a_turn_is_seen_where_there_are_bosses_and_nowhere_else() -> None:
    assert solved(8, 0)[1].roll_seen.all()
    assert not joint(shot(turns(4), 0, shape=SHAPE, bossed=False).views).roll_seen.any()


@pytest.mark.study
def test_bosses_tell_of_the_turn_and_a_round_part_does_not() -> None:
    bossed = found(8)
    assert all(f.roll_seen.all() for _, f in bossed)
    assert np.abs(rolls_deg(bossed)).max() < 4.0
    assert np.sqrt(np.mean(rolls_deg(bossed) ** 2)) < 1.2
    plain = [
        (one, joint(one.views))
        for one in (shot(turns(4), seed, shape=SHAPE, bossed=False) for seed in range(4))
    ]
    assert not any(f.roll_seen.any() for _, f in plain)
    assert np.abs(rolls_deg(plain)).max() < 4.0
    robot = plain[0][1].roll_sigma_deg[1:]
    stated = np.mean([f.roll_sigma_deg[1] for _, f in bossed])  # neighbours see the most in common
    assert stated < 0.8 * robot.mean()
    assert robot.max() < np.sqrt(2.0) * 0.2  # the camera's place tells of the turn besides


def test_a_motion_of_the_world_moves_the_result_along() -> None:
    world = motion(np.array([40.0, -70.0, 110.0]), np.array([300.0, -200.0, 900.0]))
    moved = joint(shot(turns(4), 0, shape=SHAPE, world=world).views)
    _, still = solved(4, 0)
    stated = np.degrees(np.sqrt(still.axes_camera[0].covariance[0, 0]))
    for one, other in zip(moved.axes_camera, still.axes_camera, strict=True):
        assert np.degrees(np.linalg.norm(one.direction - other.direction)) < 0.5 * stated
        assert one.sigma_deg == pytest.approx(other.sigma_deg, rel=0.15)
    assert moved.axis.sigma_deg == pytest.approx(still.axis.sigma_deg, rel=0.05)
    turned = np.linalg.inv(world) @ moved.T_world_camera
    np.testing.assert_allclose(turned[:, :3, 3], still.T_world_camera[:, :3, 3], atol=0.3)  # at 400 mm


def test_the_order_of_the_views_changes_nothing() -> None:
    given, straight = solved(4, 1)
    order = [2, 0, 3, 1]
    mixed = joint([given.views[k] for k in order])
    stated = np.degrees(np.sqrt(straight.axes_camera[0].covariance[0, 0]))
    for k, n in enumerate(order):
        off = np.linalg.norm(mixed.axes_camera[k].direction - straight.axes_camera[n].direction)
        assert np.degrees(off) < 0.5 * stated
    np.testing.assert_allclose(mixed.T_world_camera, straight.T_world_camera[order], atol=0.02)


def test_the_curve_is_the_true_one() -> None:
    """Its z is that of the part frame, whose origin the robot's errors shift: compared at its best shift."""
    _, f = solved(8, 0)
    z, r = f.generatrix.z_mm, f.generatrix.r_mm
    inner = np.isfinite(z) & (np.abs(z - np.nanmean(z)) < 0.8 * HALF_MM)
    sense = 1.0 if f.axis.direction[2] > 0.0 else -1.0
    off = [
        np.median(np.abs(r[inner] - radius(sense * z[inner] + shift))) for shift in np.arange(-2.0, 2.0, 0.01)
    ]
    assert min(off) < 0.01


def test_the_faces_tell_which_side_is_air() -> None:
    """The same points as a shaft and as a bore: what lies farther from the axis is outside, or within."""
    views = shot(turns(2), 5, shape=SHAPE).views
    for turned, air in ((1, 1.0), (-1, -1.0)):
        f = joint([replace(view, faces=view.faces[:, ::turned]) for view in views])
        cloud = placed(f.T_world_camera[0], views[0].vertices_mm)
        away = cloud - f.axis.point_mm
        away -= np.outer(away @ f.axis.direction, f.axis.direction)
        off = deviation_mm(cloud + 0.01 * away, f.axis, f.generatrix)
        assert np.nanmedian(off) == pytest.approx(air * 0.5, abs=0.1)


def test_poses_worse_than_stated_do_not_spoil_the_axis() -> None:
    """Twice the accuracy that is stated: the surfaces say where the axis is in each camera."""
    one = shot(turns(4), 3, shape=SHAPE, robot_mm=1.0, robot_deg=0.4)
    f = joint(one.views, prior=PosePrior(sigma_mm=0.5, sigma_deg=0.2))
    error = np.array([axis_error(a, T) for a, T in zip(f.axes_camera, one.true, strict=True)])
    assert np.degrees(np.abs(error[:, :2])).max() < 4.0 * f.axes_camera[0].sigma_deg


def test_what_cannot_be_estimated_is_refused() -> None:
    (view,) = shot([0.0], 0, shape=SHAPE).views
    with pytest.raises(InputError, match="no views"):
        joint([])
    with pytest.raises(InputError, match="view 2: 40 points are too few"):
        joint([view, replace(view, vertices_mm=view.vertices_mm[:40], sigma_mm=view.sigma_mm[:40])])
    sheared = np.diag([1.0, 1.2, 1.0, 1.0])
    with pytest.raises(InputError, match="view 1: scales or shears"):
        joint([replace(view, T_world_camera=sheared)])
    with pytest.raises(InputError, match="above zero"):
        PosePrior(sigma_mm=0.0)


def test_a_view_of_another_part_or_from_elsewhere_is_refused() -> None:
    given = shot(turns(4), 0, shape=SHAPE)
    part = given.views[2].vertices_mm
    other = part + 1.5 * np.sin(0.3 * part[:, [1, 2, 0]])
    with pytest.raises(InputError, match=r"view 3: .* same part"):
        joint([*given.views[:2], replace(given.views[2], vertices_mm=other), given.views[3]])
    lost = given.views[1].T_world_camera @ motion(np.array([0.0, 9.0, 0.0]), np.array([30.0, 0.0, 0.0]))
    with pytest.raises(InputError, match=r"reported pose"):
        joint([given.views[0], replace(given.views[1], T_world_camera=lost), *given.views[2:]])


def from_above(seed: int, *, robot_deg: float) -> Shot:
    """Four views of a stepped drum from 55 to 75 degrees above: ten thousand points of faces, few of walls.

    A robot's error of angle acts over the 600 mm to the part: it moves the walls by millimetres.
    """
    rng = np.random.default_rng(seed)
    views, true = [], []
    for turn, elevation in ((0.0, 55.0), (90.0, 75.0), (180.0, 55.0), (-90.0, 55.0)):
        across, along = (grid.ravel() for grid in np.meshgrid(*[np.arange(-70.0, 70.0, 1.0)] * 2))
        away = np.hypot(across, along)
        phi = np.radians(turn + np.linspace(-60.0, 60.0, 80))[:, None]
        walls = [
            np.stack(np.broadcast_arrays(r * np.cos(phi), r * np.sin(phi), z), axis=-1).reshape(-1, 3)
            for r, z in ((40.0, np.arange(1.0, 16.0, 1.5)), (70.0, np.arange(-19.0, 1.0, 2.0)))
        ]
        lower = (away > 44.0) & (away < 70.0)
        points = np.concatenate(
            [
                np.stack([across, along, np.full_like(away, 16.0)], axis=1)[away < 40.0],
                np.stack([across, along, np.full_like(away, 1.0)], axis=1)[lower],
                *walls,
            ]
        )
        pose = true_pose(turn)
        lean = Rotation.from_rotvec(np.radians(elevation) * -pose[:3, 0]).as_matrix()
        pose[:3, :3] = lean @ pose[:3, :3]
        pose[:3, 3] = -600.0 * pose[:3, 2]
        points = points + 0.03 * rng.normal(size=points.shape)
        error = motion(robot_deg * rng.normal(size=3), 0.3 * rng.normal(size=3))
        rough = pose.copy()
        rough[:3, :3] = error[:3, :3] @ pose[:3, :3]
        rough[:3, 3] += error[:3, 3]
        own = (points - pose[:3, 3]) @ pose[:3, :3]
        nothing = np.zeros((0, 3), np.int32)
        views.append(PosedSurface(own, nothing, np.full(len(own), 0.03), rough))
        true.append(pose)
    return Shot(views, true)


@some_of("seed", [0, 3, 10])
def test_walls_that_the_robot_puts_millimetres_off_are_not_shut_out_by_faces(seed: int) -> None:
    drawn = from_above(seed, robot_deg=0.5)
    result = joint(drawn.views, prior=PosePrior(sigma_mm=0.3, sigma_deg=0.5))
    for settled, pose in zip(result.T_world_camera, drawn.true, strict=True):
        # the part's axis, where each view's walls put it
        there = placed(settled @ np.linalg.inv(pose), np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 16.0]]))
        off = there - result.axis.point_mm
        across = off - np.outer(off @ result.axis.direction, result.axis.direction)
        assert np.linalg.norm(across, axis=1).max() < 0.03
