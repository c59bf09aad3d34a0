"""Folders of board pictures at several poses of a robot, and ``hand_eye.json``."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from burrscan.arrays import Floats, Image
from burrscan.calibration.board import Board, find_corners
from burrscan.calibration.hand_eye import (
    REPEATABILITY_DEG,
    REPEATABILITY_MM,
    HandEye,
    HandEyeView,
)
from burrscan.captures.png import read_grey
from burrscan.documents import STRICT, build, read_json
from burrscan.errors import InputError
from burrscan.files import written_whole
from burrscan.pose import exponential, rigid
from burrscan.rig import View

Positive = Annotated[float, Field(gt=0.0)]
Row = tuple[float, float, float, float]
_COLUMNS = ("image", "x_mm", "y_mm", "z_mm", "rx_deg", "ry_deg", "rz_deg")
_WHOLE_TURN_DEG = 360.0
"""Largest part of a rotation vector: no arm means more."""
_INSIDE = 0.25
"""Half width of what is looked at of a square, in squares."""


@dataclass(frozen=True)
class PosePicture:
    """A picture, and where the robot said its flange was."""

    __pydantic_config__ = STRICT

    image: str
    T_base_flange: tuple[Row, Row, Row, Row]


@dataclass(frozen=True)
class PosesDocument:
    """``poses.json``."""

    __pydantic_config__ = STRICT

    format: Literal["burrscan-hand-eye-poses"]
    version: Literal[1]
    poses: tuple[PosePicture, ...]
    repeatability_mm: Positive = REPEATABILITY_MM
    repeatability_deg: Positive = REPEATABILITY_DEG


@dataclass(frozen=True)
class PosedPictures:
    """Pictures and the reported poses of the flange, with the arm's repeatability."""

    pictures: tuple[tuple[Path, Floats], ...]
    repeatability_mm: float
    repeatability_deg: float


def read_posed_pictures(folder: Path) -> PosedPictures:
    """Read ``poses.json`` or ``poses.csv`` of a folder; pictures are read later, one at a time.

    Raises
    ------
    InputError
        When neither is there or one cannot be used.

    """
    if (folder / "poses.json").exists():
        told = build(PosesDocument, _document(folder / "poses.json"), source=str(folder / "poses.json"))
        pictures = tuple(
            (folder / one.image, rigid(np.array(one.T_base_flange), what=f"{folder}: pose of {one.image}"))
            for one in told.poses
        )
        return PosedPictures(pictures, told.repeatability_mm, told.repeatability_deg)
    if (folder / "poses.csv").exists():
        return PosedPictures(_rows(folder / "poses.csv"), REPEATABILITY_MM, REPEATABILITY_DEG)
    raise InputError(
        f"{folder}: no poses.json and no poses.csv; write where the robot said its flange was for each "
        "picture"
    )


def _document(path: Path) -> dict[str, Any]:
    document = read_json(path)
    if not isinstance(document, dict):
        raise InputError(f"{path}: not a JSON object with poses")
    return document


def _rows(path: Path) -> tuple[tuple[Path, Floats], ...]:
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: cannot be read as CSV: {error}") from error
    if not rows or set(rows[0]) != set(_COLUMNS):
        raise InputError(
            f"{path}: its first line must name the columns {','.join(_COLUMNS)}, and rows follow"
        )
    return tuple(
        (path.parent / str(row["image"]), _flange(path, line, row)) for line, row in enumerate(rows, 2)
    )


def _flange(path: Path, line: int, row: dict[str, Any]) -> Floats:
    try:
        numbers = np.array([float(row[name]) for name in _COLUMNS[1:]])
    except (TypeError, ValueError) as error:
        raise InputError(f"{path}: line {line}: not six numbers after the picture's name") from error
    if not np.isfinite(numbers).all():
        raise InputError(f"{path}: line {line}: numbers must be finite")
    if np.abs(numbers[3:]).max() > _WHOLE_TURN_DEG:
        raise InputError(f"{path}: line {line}: {_COLUMNS[4]} and the others are degrees, of a turn at most")
    pose = exponential(np.concatenate([np.radians(numbers[3:]), numbers[:3]]))
    return rigid(pose, what=f"{path}: line {line}")


def hand_eye_view(path: Path, T_base_flange: Floats, board: Board, camera: View) -> HandEyeView | None:
    """Find the board's corners in a picture, counted from the same one in every picture.

    None where no whole board is in sight.

    Raises
    ------
    InputError
        When the picture cannot be read or has another size than the camera; and for a board that looks the
        same upside down.

    """
    if (board.columns + board.rows) % 2 == 0:
        raise InputError(
            f"a board of {board.columns}×{board.rows} inner corners looks the same upside down, and an arm "
            "may turn the camera that far: take one with an even and an odd number"
        )
    picture = read_grey(path)
    if picture.shape != camera.shape:
        raise InputError(
            f"{path}: {picture.shape[1]}×{picture.shape[0]} pixels, the rig's camera has "
            f"{camera.width}×{camera.height}"
        )
    corners = find_corners(picture, board, lens=camera)
    if corners is None:
        return None
    return HandEyeView(
        str(path), T_base_flange, corners if _first_dark(picture, corners, board) else corners[::-1]
    )


def _first_dark(picture: Image, corners: Floats, board: Board) -> bool:
    """Whether the square among the first four corners is darker than its neighbour."""
    grid = corners.reshape(board.rows, board.columns, 2)
    return _grey(picture, grid[:2, :2]) < _grey(picture, grid[:2, 1:3])


def _grey(picture: Image, square: Floats) -> float:
    middle = square.mean(axis=(0, 1))
    half = _INSIDE * np.abs(square - middle).max()
    x, y = (slice(max(int(m - half), 0), int(m + half) + 1) for m in middle)
    return float(np.median(picture[y, x]))


@dataclass(frozen=True)
class HandEyeDocument:
    """``hand_eye.json``."""

    __pydantic_config__ = STRICT

    format: Literal["burrscan-hand-eye"]
    version: Literal[1]
    unit: Literal["mm"]
    T_flange_camera: tuple[Row, Row, Row, Row]
    T_base_board: tuple[Row, Row, Row, Row]
    covariance: tuple[tuple[float, ...], ...]


def hand_eye_document(found: HandEye) -> dict[str, Any]:
    """A calibration as a plain document for JSON."""
    return {
        "format": "burrscan-hand-eye",
        "version": 1,
        "unit": "mm",
        "T_flange_camera": found.T_flange_camera.tolist(),
        "T_base_board": found.T_base_board.tolist(),
        "covariance": found.covariance.tolist(),
    }


def write_hand_eye(path: Path, found: HandEye) -> None:
    """Write a calibration as JSON, whole or not at all."""
    with written_whole(path) as beside:
        beside.write_text(json.dumps(hand_eye_document(found), indent=1) + "\n", "utf-8")


def read_hand_eye(path: Path) -> tuple[Floats, Floats]:
    """``T_flange_camera`` (4, 4) and its covariance (6, 6) from ``hand_eye.json``.

    Raises
    ------
    InputError
        With every error in the file.

    """
    told = build(HandEyeDocument, _document(path), source=str(path))
    covariance = (
        np.array(told.covariance, dtype=float) if len({len(r) for r in told.covariance}) == 1 else np.zeros(0)
    )
    if covariance.shape != (12, 12):
        raise InputError(f"{path}: covariance must be 12 rows of 12 numbers")
    return rigid(np.array(told.T_flange_camera), what=f"{path}: T_flange_camera"), covariance[:6, :6]
