"""Corners, homographies and the adjustment, against geometry and statistics."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from scipy import stats
from scipy.spatial.transform import Rotation

from burrscan import Correspondence, InputError, Rig
from burrscan.arrays import Floats
from burrscan.calibration.board import Board, BoardView, find_corners, projector_corners
from burrscan.calibration.corners import refined
from burrscan.calibration.geometric import Calibration, calibrate
from burrscan.captures.png import read_grey
from burrscan.rig import View
from scenes.board import board_poses
from scenes.rig import DeviceSpec, RigSpec
from tests.burrscan.boards import drawn_board
from tests.data import HERE

BOARD = Board(9, 6, 20.0)
LENS = (-0.12, 0.05, 0.001, -0.0005, 0.0)


def true_rig() -> Rig:
    camera = DeviceSpec(width=1280, height=1024, focal_px=2743.0, distortion=LENS, cx=650.0, cy=500.0)
    projector = DeviceSpec(width=1024, height=768, focal_px=2048.0, cy=700.0, distortion=LENS)
    return RigSpec(camera=camera, projector=projector).rig()


def parameters(rig: Rig, distortion: int) -> Floats:
    """In the order of a calibration's names."""
    devices = [
        [view.fx, view.fy, view.cx, view.cy, *view.distortion[:distortion]]
        for view in (rig.camera, rig.projector)
    ]
    turn = Rotation.from_matrix(rig.T_projector_camera[:3, :3]).as_rotvec()
    return np.concatenate([*devices, turn, rig.T_projector_camera[:3, 3]])


def synthetic(seed: int, *, count: int = 8, noise_px: tuple[float, float] = (0.03, 0.08)) -> list[BoardView]:
    rng = np.random.default_rng(seed)
    rig, views = true_rig(), []
    for i, pose in enumerate(board_poses(BOARD, count=count, seed=seed, standoff_mm=600.0, reach_mm=30.0)):
        points = BOARD.points_mm @ pose[:3, :3].T + pose[:3, 3]
        seen = [rig.camera.project(points), rig.correspond(points)]
        noisy = [
            pixels + sigma * rng.standard_normal(pixels.shape)
            for pixels, sigma in zip(seen, noise_px, strict=True)
        ]
        views.append(BoardView(str(i), noisy[0], noisy[1]))
    return views


def distance_px(found: Floats, truth: Floats) -> float:
    """RMS; a board may be read from either end."""
    ends = (found, found[::-1])
    return float(min(np.sqrt(((end - truth) ** 2).sum(axis=1).mean()) for end in ends))


def calibrated(views: list[BoardView]) -> Calibration:
    return calibrate(views, BOARD, camera=(1280, 1024), projector=(1024, 768), distortion=4)


def test_stated_uncertainties_are_those_of_many_calibrations() -> None:
    """Over 8 calibrations the squared Mahalanobis distance from the truth follows its chi-square (z < 4)."""
    truth = parameters(true_rig(), 4)
    distances = []
    for seed in range(8):
        found = calibrated(synthetic(seed))
        off = found.values - truth
        distances.append(off @ np.linalg.solve(found.covariance, off))
        assert found.sigma_px == pytest.approx((0.03, 0.08), rel=0.15)
    total, freedom = sum(distances), 8 * len(truth)
    assert abs(total - freedom) < 4.0 * np.sqrt(2.0 * freedom) * 1.1  # sigma is estimated, too


def test_a_wild_corner_is_set_aside() -> None:
    views = synthetic(1)
    spoiled = np.array(views[2].camera_px)
    spoiled[17] += (4.0, -3.0)
    views[2] = BoardView("2", spoiled, views[2].projector_px)
    found = calibrated(views)
    assert found.refused >= 1
    pulls = (found.values - parameters(true_rig(), 4)) / found.sigma
    assert np.abs(pulls).max() < 4.5


def test_unknown_projector_corners_are_left_out() -> None:
    views = synthetic(3)
    partial = np.array(views[0].projector_px)
    partial[:20] = np.nan
    views[0] = BoardView("0", views[0].camera_px, partial)
    found = calibrated(views)
    assert found.corners[0] <= 34
    assert np.abs((found.values - parameters(true_rig(), 4)) / found.sigma).max() < 4.5


def test_a_lens_that_would_fold_has_fewer_coefficients() -> None:
    """Boards that cover the middle only, with poor corners: k2 would be -4 where 0.05 is true."""
    views = synthetic(1, count=4, noise_px=(0.1, 0.5))
    with pytest.raises(InputError, match=r"some pixels would look nowhere; add views .* fewer"):
        calibrated(views)
    found = calibrate(views, BOARD, camera=(1280, 1024), projector=(1024, 768))
    assert [name for name in found.names if name[-2] in "kp"] == [
        f"{device}.{k}" for device in ("camera", "projector") for k in ("k1", "k2")
    ]
    good = calibrate(synthetic(0), BOARD, camera=(1280, 1024), projector=(1024, 768))
    assert good.names == calibrated(synthetic(0)).names


def test_too_few_and_untilted_views_are_refused() -> None:
    views = synthetic(0)
    with pytest.raises(InputError, match="at least 3"):
        calibrated(views[:2])
    with pytest.raises(InputError, match="known are"):
        calibrate(views, BOARD, camera=(1280, 1024), projector=(1024, 768), distortion=3)
    rig = true_rig()
    flat = BOARD.points_mm - BOARD.points_mm.mean(axis=0) + (0.0, 0.0, 600.0)
    same = [
        BoardView(str(i), rig.camera.project(flat + aside), rig.correspond(flat + aside))
        for i, aside in enumerate(np.outer(np.arange(4.0), [1.0, 0.0, 0.0]))
    ]
    noisy = [
        BoardView(v.name, v.camera_px + 0.1 * np.sin(np.arange(108) * (i + 1)).reshape(54, 2), v.projector_px)
        for i, v in enumerate(same)
    ]
    with pytest.raises(InputError, match="tilted"):
        calibrated(noisy)


@pytest.mark.parametrize("noise", [0.0, 8.0])
def test_corners_are_found_to_a_hundredth_of_a_pixel(noise: float) -> None:
    """On a board drawn by pixel coverage; OpenCV's detector is worse."""
    image, truth = drawn_board(BOARD, noise=noise, seed=1)
    found = find_corners(image, BOARD)
    assert found is not None
    rms = distance_px(found, truth)
    assert rms < (0.02 if noise == 0.0 else 0.05)
    flags = cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY
    grey = np.clip(image / 4.0, 0, 255).astype(np.uint8)
    theirs = np.asarray(cv2.findChessboardCornersSB(grey, (9, 6), flags=flags)[1]).reshape(-1, 2)
    assert rms < distance_px(theirs, truth)


def test_refinement_recovers_from_starts_a_pixel_off() -> None:
    image, truth = drawn_board(BOARD, noise=2.0, seed=2)
    start = truth + np.random.default_rng(0).uniform(-1.0, 1.0, truth.shape)
    assert np.abs(refined(image, start, rows=BOARD.rows) - truth).max() < 0.06


def test_no_board_is_no_corners() -> None:
    noise = np.random.default_rng(0).integers(0, 200, (240, 320)).astype(np.uint16)
    assert find_corners(noise, BOARD) is None


def test_homographies_carry_corners_through_wrong_codes() -> None:
    """A quantised homography with 2 % of wild codes; the error is that of the rounding, averaged."""
    rng = np.random.default_rng(0)
    rows, columns = np.mgrid[:240, :320].astype(float)
    h = np.array([[0.8, 0.05, 10.0], [-0.04, 0.82, 6.0], [1e-4, -5e-5, 1.0]])
    x, y, w = (line[0] * columns + line[1] * rows + line[2] for line in h)
    u, v = np.rint(x / w).astype(np.float32), np.rint(y / w).astype(np.float32)
    wild = rng.random(u.shape) < 0.02
    u[wild] += rng.integers(-200, 200, int(wild.sum()))
    sigma = np.full(u.shape, 0.3, np.float32)
    corners = np.stack(np.meshgrid(60.0 + 22.3 * np.arange(9), 55.0 + 22.7 * np.arange(6)), axis=-1).reshape(
        -1, 2
    )
    mask = np.ones(u.shape, bool)
    mask[40:75, 40:75] = False
    found, slope = projector_corners(corners, Correspondence(u, sigma, mask, v, sigma), BOARD)
    true = np.stack([line[0] * corners[:, 0] + line[1] * corners[:, 1] + line[2] for line in h], axis=-1)
    error = found - true[:, :2] / true[:, 2:]
    assert np.isnan(found[0]).all()  # nothing decodes around it
    known = np.isfinite(error[:, 0])
    assert known.sum() >= 52
    assert np.abs(slope[known] - h[:2, :2]).max() < 0.08
    assert np.sqrt((error[known] ** 2).mean()) < 0.05


def test_the_real_board_is_found_and_flat() -> None:
    """A real photograph of a 9×7 board: its corners fit one homography to a tenth of a pixel."""
    white = read_grey(HERE / "procam" / "white.png")
    board = Board(9, 7, 1.0)
    corners = find_corners(white, board)
    assert corners is not None
    flat = board.points_mm[:, :2]
    h, _ = cv2.findHomography(flat, corners)
    fitted = cv2.perspectiveTransform(flat[None], h)[0]
    assert np.sqrt(((fitted - corners) ** 2).sum(axis=1).mean()) < 0.25  # paper, and a lens that distorts


def test_sigma_follows_the_number_of_views() -> None:
    few, many = (calibrated(synthetic(5, count=n)) for n in (4, 16))
    ratio = np.median(few.sigma / many.sigma)
    assert 1.4 < ratio < 3.5
    assert (
        stats.chi2.sf(float(np.sum(((many.values - parameters(true_rig(), 4)) / many.sigma) ** 2)), 22) > 1e-9
    )


def test_edges_along_the_raster_do_not_lock_to_it() -> None:
    """A sharp edge between columns is cut at the same place by all its pixels: their box is in the model."""
    view = View(128, 104, 400.0, 400.0, 63.5, 51.5)
    board = Board(5, 4, 20.0)
    image, truth = drawn_board(board, noise=0.0, seed=0, view=view, tilt_deg=(0.0, 25.0, 0.5), fine=24)
    found = find_corners(image, board)
    assert found is not None
    assert distance_px(found, truth) < 0.006


@pytest.mark.study
def test_a_known_lens_straightens_edges() -> None:
    view = View(320, 256, 686.0, 686.0, 159.5, 127.5, (-0.3, 0.1, 0.0, 0.0, 0.0))
    image, truth = drawn_board(BOARD, noise=0.0, seed=0, view=view)
    bent, straight = find_corners(image, BOARD), find_corners(image, BOARD, lens=view)
    assert bent is not None
    assert straight is not None
    assert distance_px(straight, truth) < 0.003 < distance_px(bent, truth)
    pixels = view.pixel_grid()[::50, ::50]
    assert view.bent(view.straight(pixels)) == pytest.approx(pixels, abs=1e-6)
