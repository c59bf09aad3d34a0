"""Hand-eye calibration: the truth within what is stated, over many draws; and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import binom, chi2

from burrscan.arrays import Floats
from burrscan.calibration.hand_eye import HandEye, calibrate_hand_eye
from burrscan.errors import InputError
from tests.burrscan.arm import BOARD, CAMERA, Arm, arm, motion

DRAWS = 120


def twist(found: Floats, true: Floats) -> Floats:
    """(6,) by which a pose is off: true = found · exp(twist)."""
    off = np.linalg.inv(found) @ true
    return np.array([*Rotation.from_matrix(off[:3, :3]).as_rotvec(), *off[:3, 3]])


def draws(count: int = DRAWS, **options: float) -> list[tuple[Arm, HandEye]]:
    found = []
    for seed in range(count):
        rng = np.random.default_rng(seed)
        one = arm(rng, **options)  # type: ignore[arg-type]
        found.append((one, calibrate_hand_eye(one.views(rng), BOARD, CAMERA)))
    return found


@pytest.fixture(scope="module")
def many() -> list[tuple[Arm, HandEye]]:
    return draws()


def squares(many: list[tuple[Arm, HandEye]]) -> Floats:
    """(draws, 2) squared errors of X and of Z in their stated covariances."""
    rows = []
    for one, found in many:
        off = [twist(found.T_flange_camera, one.T_flange_camera), twist(found.T_base_board, one.T_base_board)]
        blocks = [found.covariance[:6, :6], found.covariance[6:, 6:]]
        rows.append([e @ np.linalg.solve(c, e) for e, c in zip(off, blocks, strict=True)])
    return np.array(rows)


@pytest.mark.study
def test_the_truth_lies_in_the_stated_ellipsoids(many: list[tuple[Arm, HandEye]]) -> None:
    """X and Z, six numbers each, 120 random arms: the 95 % ellipsoid holds 95 of 100 of them.

    Noises are estimated from 60 residuals of poses, so that a chi-squared is an F with 60 degrees more or
    less: its mean is 3 % higher.
    """
    square = squares(many)
    for part in square.T:
        held = int(np.count_nonzero(part < chi2.ppf(0.95, 6)))
        assert binom.ppf(2e-4, DRAWS, 0.93) <= held
        assert part.mean() == pytest.approx(6.0 * 1.03, abs=3.5 * np.sqrt(12.0 / DRAWS) + 0.5)
        assert part.mean() > 4.0


@pytest.mark.study
def test_the_noises_are_those_that_were_put_in(many: list[tuple[Arm, HandEye]]) -> None:
    assert np.mean([found.sigma_px for _, found in many]) == pytest.approx(0.03, rel=0.02)
    assert np.median([found.robot_factor for _, found in many]) == pytest.approx(1.0, abs=0.1)
    place = [np.linalg.norm(found.T_flange_camera[:3, 3] - one.T_flange_camera[:3, 3]) for one, found in many]
    assert np.median(place) < 0.15  # mm: 0.05 mm of ten poses, and 0.01 degree at 600 mm


@pytest.mark.study
def test_an_arm_less_accurate_than_it_repeats_widens_what_is_stated() -> None:
    """Ten times the repeatability in both: the residuals show it, and the ellipsoids still hold the truth."""
    found = draws(60, robot_mm=0.5, robot_deg=0.1)
    assert np.median([one.robot_factor for _, one in found]) == pytest.approx(10.0, rel=0.15)
    assert squares(found)[:, 0].mean() < 6.0 * 1.7


def test_the_adjustment_is_better_than_the_closed_form() -> None:
    """Corners of 0.3 px and a good arm: OpenCV's start knows nothing of which is better."""
    from burrscan.calibration import hand_eye  # noqa: PLC0415

    ours, theirs = [], []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        one = arm(rng)
        views = one.views(rng, sigma_px=0.3)
        found = calibrate_hand_eye(views, BOARD, CAMERA)
        start, _ = hand_eye._start(views, BOARD, CAMERA)
        ours.append(twist(found.T_flange_camera, one.T_flange_camera)[3:])
        theirs.append(twist(start, one.T_flange_camera)[3:])
    assert np.sqrt(np.mean(np.square(ours))) < 0.8 * np.sqrt(np.mean(np.square(theirs)))


def test_a_better_arm_gives_a_smaller_sigma() -> None:
    rng = np.random.default_rng(1)
    one = arm(rng, robot_mm=0.005, robot_deg=0.001)
    views = one.views(rng)
    good = calibrate_hand_eye(views, BOARD, CAMERA, robot_mm=0.005, robot_deg=0.001)
    usual = calibrate_hand_eye(views, BOARD, CAMERA)
    assert good.sigma_mm.max() < 0.5 * usual.sigma_mm.max()


def test_poses_that_leave_something_open_are_refused_by_name() -> None:
    rng = np.random.default_rng(2)
    about_one = arm(rng, tilt_deg=np.array([0.0, 0.0, 60.0])).views(rng)
    with pytest.raises(InputError, match=r"about one axis of the flange, \(.*place along it open: add poses"):
        calibrate_hand_eye(about_one, BOARD, CAMERA)
    still = arm(rng, tilt_deg=np.array([0.5, 0.5, 0.5])).views(rng)
    with pytest.raises(InputError, match=r"turn by .* deg only"):
        calibrate_hand_eye(still, BOARD, CAMERA)
    with pytest.raises(InputError, match=r"3 pose\(s\) with a board: at least 4"):
        calibrate_hand_eye(arm(rng).views(rng)[:3], BOARD, CAMERA)


def test_poses_of_other_pictures_are_refused() -> None:
    rng = np.random.default_rng(3)
    views = arm(rng).views(rng)
    turned = [
        replace(v, T_base_flange=w.T_base_flange) for v, w in zip(views, views[1:] + views[:1], strict=True)
    ]
    backwards = [replace(v, T_base_flange=np.asarray(np.linalg.inv(v.T_base_flange))) for v in views]
    for wrong in (turned, backwards):
        with pytest.raises(InputError, match=r"not those of the pictures: .* order and unit"):
            calibrate_hand_eye(wrong, BOARD, CAMERA)


def test_where_the_base_is_does_not_matter() -> None:
    rng = np.random.default_rng(4)
    views = arm(rng).views(rng)
    base = motion(np.array([20.0, 50.0, -100.0]), np.array([1000.0, -300.0, 200.0]))
    moved = [replace(view, T_base_flange=base @ view.T_base_flange) for view in views]
    one, other = (calibrate_hand_eye(each, BOARD, CAMERA) for each in (views, moved))
    np.testing.assert_allclose(one.T_flange_camera, other.T_flange_camera, atol=1e-4)
    np.testing.assert_allclose(base @ one.T_base_board, other.T_base_board, atol=1e-4)
