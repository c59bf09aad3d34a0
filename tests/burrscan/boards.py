"""Boards drawn by exact geometry: every pixel is the mean of many points of it."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from burrscan.arrays import Floats, Image
from burrscan.calibration.board import Board

_FINE = 8


def drawn_board(
    board: Board, *, noise: float, seed: int, shape: tuple[int, int] = (256, 320), focal_px: float = 686.0
) -> tuple[Image, Floats]:
    """A tilted board as a pinhole camera sees it, (h, w) of some 900 DN, and its true corners (n, 2)."""
    turn = Rotation.from_euler("xyz", [22.0, -17.0, 4.0], degrees=True).as_matrix()
    centre = np.array([4.0, -3.0, 600.0])
    middle = board.points_mm.mean(axis=0)
    height, width = shape
    fine = (np.arange(_FINE) + 0.5) / _FINE - 0.5
    rows = (np.arange(height)[:, None] + fine).ravel() - (height - 1) / 2
    columns = (np.arange(width)[:, None] + fine).ravel() - (width - 1) / 2
    rays = np.stack(np.broadcast_arrays(columns, rows[:, None], focal_px), axis=-1) / focal_px
    depth = (turn[:, 2] @ centre) / (rays @ turn[:, 2])
    on_board = (rays * depth[..., None] - centre) @ turn + middle
    squares = np.floor(on_board[..., :2] / board.square_mm).astype(int) + 1
    inside = ((squares >= 0) & (squares <= (board.columns, board.rows))).all(axis=-1)
    dark = inside & (squares.sum(axis=-1) % 2 == 0)
    image = np.where(dark, 60.0, 900.0).reshape(height, _FINE, width, _FINE).mean(axis=(1, 3))
    noisy = image + noise * np.random.default_rng(seed).standard_normal(shape)
    points = (board.points_mm - middle) @ turn.T + centre
    truth = points[:, :2] / points[:, 2:] * focal_px + ((width - 1) / 2, (height - 1) / 2)
    return np.clip(np.rint(noisy), 0, 1023).astype(np.uint16), truth
