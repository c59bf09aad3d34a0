"""Where a camera sits on a robot's flange, from pictures of a board that stands still.

Two poses are unknown: the camera on the flange, X, and the board in the robot's base, Z. A closed form starts
(OpenCV 5 no longer has one for Python); then all corners and all reported poses are adjusted together: the
arm was where it says but for its repeatability, so every pose gets a small motion of its own that is held by
it (Strobl & Hirzinger 2006 weigh the two likewise). Both noises are estimated from the residuals (variance
components, Helmert 1907): an arm whose accuracy is worse than its repeatability shows it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from burrscan.arrays import Floats, freeze
from burrscan.calibration.board import Board
from burrscan.errors import InputError
from burrscan.pose import cross_matrix, exponential
from burrscan.rig import View

FEWEST_POSES = 4
"""Three determine both poses without a check; the fourth says how well."""
REPEATABILITY_MM, REPEATABILITY_DEG = 0.05, 0.01
"""Of a reported pose, one sigma per axis: what a common six-axis arm repeats to (ISO 9283)."""
_LEAST_TURN_DEG = 3.0
"""RMS turn between poses about two axes at least: below, errors of the arm count twenty times in X."""
_STEPS = 30
"""Of Gauss-Newton over all reweightings; five do from the closed form."""
_REWEIGHTED = 4
"""Estimates of both noises; they settle within two or three."""
_SETTLED = 1e-4
"""Done when nothing moves by more than this share of its standard deviation."""
_WRONG_MM, _WRONG_DEG = 10.0, 2.0
"""No arm is that inaccurate: the poses are not those of the pictures."""
_STEP = 1e-4
"""Of finite differences of the projection, relative to the distance."""


@dataclass(frozen=True)
class HandEyeView:
    """The board as the camera on the arm saw it.

    Parameters
    ----------
    name
        Of the picture.
    T_base_flange
        (4, 4) as the robot reported it.
    corners_px
        (corners, 2) in the order of :attr:`burrscan.calibration.board.Board.points_mm`.

    """

    name: str
    T_base_flange: Floats
    corners_px: Floats

    def __post_init__(self) -> None:
        freeze(self, T_base_flange=self.T_base_flange, corners_px=self.corners_px)


@dataclass(frozen=True)
class HandEye:
    """A camera on a flange, and how well that is known.

    Parameters
    ----------
    T_flange_camera, T_base_board
        (4, 4) X and Z.
    covariance
        (12, 12) of X, then Z: each a rotation vector in rad and a translation in mm by which it may be off,
        about and along its own axes (of the camera; of the board): truth = X · exp(twist).
    sigma_px
        Standard deviation of a corner's coordinate, from the residuals.
    robot_factor
        How many times worse than its repeatability the arm shows itself, at least 1.
    views
        Names of the pictures.
    rms_px
        (views,) RMS distance between corner and computed corner, the arm's own errors taken off.
    off_mm, off_deg
        (views,) how far the arm was from where it said, as estimated.

    """

    T_flange_camera: Floats
    T_base_board: Floats
    covariance: Floats
    sigma_px: float
    robot_factor: float
    views: tuple[str, ...]
    rms_px: Floats
    off_mm: Floats
    off_deg: Floats

    def __post_init__(self) -> None:
        freeze(self, T_flange_camera=self.T_flange_camera, T_base_board=self.T_base_board)
        freeze(self, covariance=self.covariance, rms_px=self.rms_px)
        freeze(self, off_mm=self.off_mm, off_deg=self.off_deg)

    @property
    def sigma_mm(self) -> Floats:
        """(3,) standard deviations of the camera's place, along its own axes."""
        return np.sqrt(np.diag(self.covariance)[3:6])

    @property
    def sigma_deg(self) -> Floats:
        """(3,) standard deviations of the camera's rotation, about its own axes."""
        return np.degrees(np.sqrt(np.diag(self.covariance)[:3]))


def calibrate_hand_eye(
    views: Sequence[HandEyeView],
    board: Board,
    camera: View,
    *,
    robot_mm: float = REPEATABILITY_MM,
    robot_deg: float = REPEATABILITY_DEG,
) -> HandEye:
    """Find a camera on a flange.

    Parameters
    ----------
    views
        At least four, whose poses turn about two axes at least; ten with turns of 20 degrees and more about
        all axes are good.
    board
        What they show; it does not move.
    camera
        Calibrated.
    robot_mm, robot_deg
        Repeatability of the arm, one sigma per axis.

    Raises
    ------
    InputError
        For too few views, poses that turn about one axis only or hardly at all, and poses that are not those
        of the pictures.

    Notes
    -----
    Dense normal equations of 12 + 6 N unknowns: O(N² · corners + N³) a step.

    """
    if len(views) < FEWEST_POSES:
        raise InputError(
            f"{len(views)} pose(s) with a board: at least {FEWEST_POSES} are needed, ten are good"
        )
    _refuse_degenerate([view.T_base_flange for view in views])
    problem = _Problem(views, board, camera, np.repeat([np.radians(robot_deg), robot_mm], 3))
    return _adjusted(problem, *_start(views, board, camera))


def _refuse_degenerate(poses: Sequence[Floats]) -> None:
    """Refuse poses that turn about one axis only, or not at all (Tsai & Lenz 1989)."""
    turns = [
        Rotation.from_matrix(one[:3, :3].T @ other[:3, :3]).as_rotvec(degrees=True)
        for one, other in combinations(poses, 2)
    ]
    values, axes = np.linalg.eigh(np.mean([np.outer(turn, turn) for turn in turns], axis=0))
    least, most = (float(np.sqrt(max(value, 0.0))) for value in values[1:])
    if most < _LEAST_TURN_DEG:
        raise InputError(
            f"the poses turn by {most:.1f} deg only, which tells nothing of where the camera sits: turn the "
            "flange by 20 degrees and more, about two axes at least"
        )
    if least < _LEAST_TURN_DEG:
        x, y, z = axes[:, 2]
        raise InputError(
            f"all poses turn about one axis of the flange, ({x:.2f}, {y:.2f}, {z:.2f}), which leaves the "
            "camera's place along it open: add poses turned about another one by 20 degrees and more"
        )


def _start(views: Sequence[HandEyeView], board: Board, camera: View) -> tuple[Floats, Floats]:
    """X and Z in closed form (Park & Martin 1994).

    Turns of the flange between poses are turns of the camera seen from the flange: the rotation of X is the
    one that brings their axes together. What is left is linear.
    """
    seen = np.stack([_board_pose(view, board, camera) for view in views])
    told = np.stack([view.T_base_flange for view in views])
    pairs = list(combinations(range(len(views)), 2))
    flange, eye = (
        np.stack([Rotation.from_matrix(one[i, :3, :3].T @ one[j, :3, :3]).as_rotvec() for i, j in pairs])
        for one in (told, np.linalg.inv(seen))
    )
    turn = Rotation.align_vectors(flange, eye)[0].as_matrix()
    board_turn = Rotation.from_matrix(told[:, :3, :3] @ turn @ seen[:, :3, :3]).mean().as_matrix()
    rows = np.concatenate([told[:, :3, :3], np.broadcast_to(-np.eye(3), (len(views), 3, 3))], axis=2)
    known = np.einsum("nij,jk,nk->ni", told[:, :3, :3], turn, seen[:, :3, 3]) + told[:, :3, 3]
    shifts = np.linalg.lstsq(rows.reshape(-1, 6), -known.ravel(), rcond=None)[0]
    X, Z = _pose(turn, shifts[:3]), _pose(board_turn, shifts[3:])
    _refuse_foreign(views, np.linalg.inv(Z) @ told @ X @ seen)
    return X, Z


def _refuse_foreign(views: Sequence[HandEyeView], off: Floats) -> None:
    """Refuse poses that are not those of the pictures: ``off`` (views, 4, 4) would be the identity."""
    shift = np.linalg.norm(off[:, :3, 3], axis=1)
    turn = np.degrees(Rotation.from_matrix(off[:, :3, :3]).magnitude())
    if np.median(shift) < _WRONG_MM and np.median(turn) < _WRONG_DEG:
        return
    worst = int(np.argmax(shift))
    raise InputError(
        f"the reported poses are not those of the pictures: they disagree by {shift[worst]:.1f} mm and "
        f"{turn[worst]:.1f} deg at {views[worst].name}: check their order and unit, that they are of the "
        "flange in the base (not the other way round), and that the board stood still"
    )


def _board_pose(view: HandEyeView, board: Board, camera: View) -> Floats:
    done, turn, shift = cv2.solvePnP(
        board.points_mm, np.ascontiguousarray(view.corners_px), camera.matrix, np.array(camera.distortion)
    )
    if not done:
        raise InputError(f"{view.name}: no pose of the board explains its corners; leave this picture out")
    return _pose(cv2.Rodrigues(turn)[0], shift)


def _pose(turn: Floats, shift: Floats) -> Floats:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, np.ravel(shift)
    return pose


@dataclass(frozen=True)
class _Problem:
    """What is adjusted: the views, the board's points, the camera, and the arm's sigma (6,)."""

    views: Sequence[HandEyeView]
    board: Board
    camera: View
    robot: Floats

    def residuals(self, X: Floats, Z: Floats, off: Floats) -> Floats:
        """Projected less seen corners, (views, 2 · corners) in pixels; see :meth:`rows`."""
        return self._off(self._seen(X, Z, off)[1])

    def rows(self, X: Floats, Z: Floats, off: Floats) -> tuple[Floats, Floats]:
        """Residuals (views, 2 · corners) in pixels and their derivatives (views, 2 · corners, 18).

        By the twists of X, of Z and of the view's own pose, each on the right of its motion; ``off`` (views,
        4, 4) are the motions between reported and real flange.
        """
        T_camera_board, points = self._seen(X, Z, off)
        back: Floats = np.asarray(np.linalg.inv(X), dtype=float)
        by = self._by_twist(points)
        slopes = np.concatenate([-by, by @ _adjoint(T_camera_board)[:, None], -by @ _adjoint(back)], axis=-1)
        return self._off(points), slopes.reshape(len(off), -1, 18)

    def _seen(self, X: Floats, Z: Floats, off: Floats) -> tuple[Floats, Floats]:
        """The board's poses in the camera (views, 4, 4), and its points there (views, corners, 3)."""
        told = np.stack([view.T_base_flange for view in self.views])
        T_camera_board: Floats = np.linalg.inv(X) @ np.linalg.inv(told @ off) @ Z
        turned = self.board.points_mm @ T_camera_board[:, :3, :3].swapaxes(1, 2)
        return T_camera_board, turned + T_camera_board[:, None, :3, 3]

    def _off(self, points: Floats) -> Floats:
        corners = np.stack([view.corners_px for view in self.views])
        return np.asarray((self.camera.project(points) - corners).reshape(len(points), -1))

    def _by_twist(self, points: Floats) -> Floats:
        """(views, corners, 2, 6) change of the pixels by a rotation about the camera and a shift."""
        step = _STEP * np.abs(points[..., 2:]).mean(axis=1, keepdims=True)
        by_point = np.stack(
            [
                (self.camera.project(points + step * one) - self.camera.project(points - step * one))
                / (2.0 * step)
                for one in np.eye(3)
            ],
            axis=-1,
        )
        turned = np.stack([points @ cross_matrix(one).T for one in np.eye(3)], axis=-1)
        return np.concatenate([by_point @ turned, by_point], axis=-1)


def _adjusted(problem: _Problem, X: Floats, Z: Floats) -> HandEye:
    """The least-squares solution from a start, both noises estimated on the way."""
    count = len(problem.views)
    off = np.repeat(np.eye(4)[None], count, axis=0)
    sigma_px, factor = 1.0, 1.0
    inverse = np.eye(12 + 6 * count)
    residual = np.zeros((count, 1))
    for step in range(_STEPS):
        residual, slopes = problem.rows(X, Z, off)
        twists = _twists(off)
        normal, pull = _normal(residual / sigma_px, slopes / sigma_px, twists, factor * problem.robot)
        inverse = np.asarray(np.linalg.inv(normal))
        change = -inverse @ pull
        X, Z = X @ exponential(change[:6]), Z @ exponential(change[6:12])
        off = np.stack(
            [own @ exponential(one) for own, one in zip(off, change[12:].reshape(-1, 6), strict=True)]
        )
        settled = float(np.sqrt(change @ normal @ change / len(change))) < _SETTLED
        if settled or step < _REWEIGHTED:
            told = sigma_px, factor
            sigma_px, factor = _noises(problem, X, Z, off, inverse, slopes, sigma_px, factor)
            if settled and np.allclose(told, (sigma_px, factor), rtol=1e-2):
                break
    residual, twists = problem.residuals(X, Z, off), _twists(off)
    return HandEye(
        X,
        Z,
        covariance=inverse[:12, :12],
        sigma_px=sigma_px,
        robot_factor=factor,
        views=tuple(view.name for view in problem.views),
        rms_px=np.sqrt(2.0 * (residual**2).mean(axis=1)),
        off_mm=np.linalg.norm(twists[:, 3:], axis=1).astype(float),
        off_deg=np.degrees(np.linalg.norm(twists[:, :3], axis=1)).astype(float),
    )


def _normal(residual: Floats, slopes: Floats, twists: Floats, robot: Floats) -> tuple[Floats, Floats]:
    """The normal matrix (12 + 6 N)² and its pull."""
    count = len(residual)
    normal, pull = np.zeros((12 + 6 * count,) * 2), np.zeros(12 + 6 * count)
    for number, (r, by, twist) in enumerate(zip(residual, slopes, twists, strict=True)):
        own = np.r_[0:12, 12 + 6 * number : 18 + 6 * number]
        normal[np.ix_(own, own)] += by.T @ by
        pull[own] += by.T @ r
        normal[own[12:], own[12:]] += robot**-2.0
        pull[own[12:]] += twist * robot**-2.0
    return normal, pull


def _noises(
    problem: _Problem,
    X: Floats,
    Z: Floats,
    off: Floats,
    inverse: Floats,
    slopes: Floats,
    sigma_px: float,
    factor: float,
) -> tuple[float, float]:
    """Both standard deviations by their residuals over their redundancy."""
    residual, twists = problem.residuals(X, Z, off), _twists(off) / (factor * problem.robot)
    free = 0.0
    for number, by in enumerate(slopes):
        own = np.r_[0:12, 12 + 6 * number : 18 + 6 * number]
        free += len(by) - float((by @ inverse[np.ix_(own, own)] * by).sum()) / sigma_px**2
    taken = np.diag(inverse)[12:].reshape(-1, 6) / (factor * problem.robot) ** 2
    corners = float(np.sqrt((residual**2).sum() / max(free, 1.0)))
    arm = factor * float(np.sqrt((twists**2).sum() / max((1.0 - taken).sum(), 1.0)))
    return max(corners, np.finfo(float).tiny), max(arm, 1.0)


def _adjoint(pose: Floats) -> Floats:
    """(..., 6, 6) takes a twist on the right of a motion (..., 4, 4) to the one on its left."""
    turn = pose[..., :3, :3]
    cross = np.einsum("...i,ijk->...jk", pose[..., :3, 3], [cross_matrix(one) for one in np.eye(3)])
    return np.block([[turn, np.zeros_like(turn)], [cross @ turn, turn]])


def _twists(poses: Floats) -> Floats:
    """(n, 6) rotation vectors and translations of motions (n, 4, 4)."""
    return np.concatenate([Rotation.from_matrix(poses[:, :3, :3]).as_rotvec(), poses[:, :3, 3]], axis=1)
