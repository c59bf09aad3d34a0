"""A camera on an arm that looks at a board: true poses, and what the arm says of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from burrscan.arrays import Floats
from burrscan.calibration.board import Board
from burrscan.calibration.hand_eye import HandEyeView
from burrscan.rig import View

BOARD = Board(10, 7, 20.0)
CAMERA = View(1280, 1024, 2700.0, 2705.0, 641.0, 510.0, (-0.08, 0.1, 0.0004, -0.0003, 0.0))


@dataclass(frozen=True)
class Arm:
    """What is sought, and the poses: real and reported."""

    T_flange_camera: Floats
    T_base_board: Floats
    real: list[Floats]
    reported: list[Floats]

    def T_camera_board(self, number: int) -> Floats:  # noqa: N802
        return np.linalg.inv(self.T_flange_camera) @ np.linalg.inv(self.real[number]) @ self.T_base_board

    def views(self, rng: np.random.Generator, *, sigma_px: float = 0.03) -> list[HandEyeView]:
        """Corners by exact projection, with noise."""
        seen = []
        for number, reported in enumerate(self.reported):
            pose = self.T_camera_board(number)
            corners = CAMERA.project(BOARD.points_mm @ pose[:3, :3].T + pose[:3, 3])
            assert np.isfinite(corners).all()
            seen.append(
                HandEyeView(f"{number}", reported, corners + sigma_px * rng.normal(size=corners.shape))
            )
        return seen


def motion(rotvec_deg: Floats, shift_mm: Floats) -> Floats:
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec(rotvec_deg, degrees=True).as_matrix()
    pose[:3, 3] = shift_mm
    return pose


def arm(
    rng: np.random.Generator,
    *,
    poses: int = 10,
    tilt_deg: Floats | None = None,
    robot_mm: float = 0.05,
    robot_deg: float = 0.01,
    distance_mm: float = 600.0,
    board: Board = BOARD,
    upside_down: int | None = None,
) -> Arm:
    """An arm that looks at a board's middle, tilted by up to ``tilt_deg`` as a rotation vector.

    Pose number ``upside_down`` is turned by half a turn besides.
    """
    X = motion(
        np.array([3.0, -5.0, 88.0]) + rng.normal(size=3), np.array([40.0, -60.0, 90.0]) + rng.normal(size=3)
    )
    Z = motion(np.array([170.0, 10.0, -20.0]), np.array([500.0, 100.0, 30.0])) @ motion(
        30.0 * rng.normal(size=3), np.zeros(3)
    )
    middle = motion(np.zeros(3), board.points_mm.mean(axis=0))
    reach = np.array([25.0, 25.0, 60.0]) if tilt_deg is None else tilt_deg
    real, reported = [], []
    for number in range(poses):
        turn = rng.uniform(-reach, reach) + (number == upside_down) * np.array([0.0, 0.0, 180.0])
        there = motion(np.zeros(3), np.array([*rng.uniform(-15, 15, 2), distance_mm + rng.uniform(-60, 60)]))
        T_camera_board = there @ motion(turn, np.zeros(3)) @ np.linalg.inv(middle)
        real.append(Z @ np.linalg.inv(T_camera_board) @ np.linalg.inv(X))
        off = motion(robot_deg * rng.normal(size=3), robot_mm * rng.normal(size=3))
        reported.append(real[-1] @ np.linalg.inv(off))
    return Arm(X, Z, real, reported)
