"""Boards drawn by exact geometry: every pixel is the mean of many points of it."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.spatial.transform import Rotation

from burrscan.arrays import Floats, Image
from burrscan.calibration.board import Board
from burrscan.rig import NO_DISTORTION, View


def drawn_board(
    board: Board,
    *,
    noise: float,
    seed: int,
    view: View = View(320, 256, 686.0, 686.0, 159.5, 127.5),  # noqa: B008 (frozen)
    tilt_deg: tuple[float, float, float] = (22.0, -17.0, 4.0),
    fine: int = 8,
    pose: Floats | None = None,
) -> tuple[Image, Floats]:
    """A tilted board as a camera sees it, (h, w) of some 900 DN, and its true corners (n, 2).

    It stands 600 mm away with that tilt, or at a ``pose`` (4, 4) of the board in the camera's frame.
    """
    if pose is None:
        image, turn, centre = _tilted(board, view, tilt_deg, fine)
    else:
        turn, centre = pose[:3, :3], pose[:3, :3] @ board.points_mm.mean(axis=0) + pose[:3, 3]
        image = _drawn(board, view, turn, centre, fine)
    noisy = image + noise * np.random.default_rng(seed).standard_normal(view.shape)
    points = (board.points_mm - board.points_mm.mean(axis=0)) @ turn.T + centre
    return np.clip(np.rint(noisy), 0, 1023).astype(np.uint16), view.project(points)


@lru_cache
def _tilted(
    board: Board, view: View, tilt_deg: tuple[float, float, float], fine: int
) -> tuple[Floats, Floats, Floats]:
    """The picture without noise, the board's turn and its middle: tests differ in the noise alone."""
    turn = Rotation.from_euler("xyz", tilt_deg, degrees=True).as_matrix()
    centre = np.array([4.0, -3.0, 600.0])
    return _drawn(board, view, turn, centre, fine), turn, centre


def _drawn(board: Board, view: View, turn: Floats, centre: Floats, fine: int) -> Floats:
    middle = board.points_mm.mean(axis=0)
    height, width = view.shape
    steps = (np.arange(fine) + 0.5) / fine - 0.5
    rows, columns = ((np.arange(n)[:, None] + steps).ravel() for n in view.shape)
    if view.distortion == NO_DISTORTION:  # a row and a column: an eighth of the time
        x, y = (columns - view.cx) / view.fx, ((rows - view.cy) / view.fy)[:, None]
    else:
        rays = view.rays(np.stack(np.broadcast_arrays(columns, rows[:, None]), axis=-1))
        x, y = rays[..., 0], rays[..., 1]

    def along(axis: int) -> Floats:
        return np.asarray(turn[0, axis] * x + turn[1, axis] * y + turn[2, axis])

    depth = (turn[:, 2] @ centre) / along(2)
    inside, parity = np.ones(depth.shape, np.bool_), np.zeros(depth.shape, np.int16)
    for axis, count in enumerate((board.columns, board.rows)):
        on_board = along(axis) * depth + (middle[axis] - turn[:, axis] @ centre)
        square = np.floor(on_board / board.square_mm).astype(np.int16) + 1
        inside &= (square >= 0) & (square <= count)
        parity += square
    dark = inside & (parity % 2 == 0)
    return np.asarray(np.where(dark, 60.0, 900.0).reshape(height, fine, width, fine).mean(axis=(1, 3)))
