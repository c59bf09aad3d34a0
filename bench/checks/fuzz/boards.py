"""Small captures of a drawn chessboard: for a rig, and for a camera on an arm. Nothing is rendered."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from burrscan.arrays import Floats, Image
from burrscan.calibration.board import Board
from burrscan.captures import RecordingScanner
from burrscan.captures.document import ScanDocument
from burrscan.captures.folder import write_rig
from burrscan.captures.gray_folder import plain_gray_patterns
from burrscan.captures.png import write_grey
from burrscan.devices import CameraSheet, ProjectorSheet
from burrscan.pose import exponential
from burrscan.rig import Rig, View
from burrscan.scan.rivals.rows_and_columns import scan_rows_and_columns
from burrscan.scanner import Patterns

BOARD = Board(7, 6, 20.0)
"""An even and an odd number of corners: the right way round on an arm, too."""
CAMERA = View(176, 152, 400.0, 400.0, 87.5, 75.5)
"""Of both calibrations."""
_PROJECTOR = View(64, 48, 125.0, 125.0, 31.5, 23.5)
_DISTANCE_MM, _BASELINE_MM = 600.0, 90.0
"""The board fills two thirds of the picture there."""
_WHITE, _BLACK, _NOISE_DN = 200.0, 16.0, 0.7
"""Of 8 bits, unclipped: light of white over the black level, that level, and noise."""
_FINE = 4
"""Points across a pixel: what a pixel sees is their mean."""
_BOARDS, _POSES = 5, 6
"""Two more, each, than the fewest that are taken: one that is damaged may be left out."""


def write_boards(folder: Path) -> None:
    """Write five captures ``00`` to ``04`` of a board that code columns and rows."""
    for number, pose in enumerate(_poses(_BOARDS, np.random.default_rng(1))):
        scanner = _BoardScanner(pose, seed=number)
        given = {"code": "gray", "parameters": {}, "exposure_ms": 1.0}
        recorder = RecordingScanner(scanner, folder / f"{number:02d}", scan=ScanDocument("both", given))
        scan_rows_and_columns(recorder, code="gray", exposure_ms=1.0)
        recorder.close()


def write_gray(folder: Path) -> None:
    """Write five plain folders ``00`` to ``04`` of Gray code on a board."""
    patterns = plain_gray_patterns(width=_PROJECTOR.width, height=_PROJECTOR.height)
    for number, pose in enumerate(_poses(_BOARDS, np.random.default_rng(4))):
        place = folder / f"{number:02d}"
        place.mkdir(parents=True)
        images = _BoardScanner(pose, seed=number).capture(patterns, 1.0)
        for name, image in zip(patterns.names, images, strict=True):
            write_grey(place / f"{name}.png", image.astype(np.uint8))


def write_arm(folder: Path) -> None:
    """Write six pictures, twice: where the flange was, in ``poses.json`` and ``csv/poses.csv``; and a rig."""
    rng = np.random.default_rng(2)
    flange = exponential(np.array([0.1, -0.2, 0.3, 40.0, -60.0, 90.0]))
    base = exponential(np.array([2.5, 0.1, -0.3, 500.0, 100.0, 30.0]))
    (folder / "csv").mkdir(parents=True)
    told, rows = [], ["image,x_mm,y_mm,z_mm,rx_deg,ry_deg,rz_deg"]
    for number, board in enumerate(_poses(_POSES, rng)):
        picture = _noisy(_WHITE * _drawn(board), rng)
        for place in (folder, folder / "csv"):
            write_grey(place / f"{number}.png", picture)
        pose = base @ np.linalg.inv(board) @ np.linalg.inv(flange)
        told.append({"image": f"{number}.png", "T_base_flange": pose.tolist()})
        rows.append(",".join([f"{number}.png", *(f"{v:.9g}" for v in _six(pose))]))
    document = {"format": "burrscan-hand-eye-poses", "version": 1, "poses": told}
    (folder / "poses.json").write_text(json.dumps(document), "utf-8")
    (folder / "csv" / "poses.csv").write_text("\n".join(rows) + "\n", "utf-8")
    write_rig(folder / "rig.json", Rig(CAMERA, CAMERA, np.eye(4)))


def _poses(count: int, rng: np.random.Generator) -> list[Floats]:
    """Poses of the board in the camera's frame, tilted in all directions."""
    middle = exponential(np.concatenate([np.zeros(3), BOARD.points_mm.mean(axis=0)]))
    poses = []
    for number in range(count):
        around = 2.0 * np.pi * number / count
        turn = np.radians(25.0) * np.array([np.cos(around), np.sin(around), rng.uniform(-0.5, 0.5)])
        place = (*rng.uniform(-12.0, 12.0, 2), _DISTANCE_MM + rng.uniform(-20.0, 20.0))
        poses.append(
            exponential(np.concatenate([np.zeros(3), place]))
            @ exponential(np.concatenate([turn, np.zeros(3)]))
            @ np.linalg.inv(middle)
        )
    return poses


def _six(pose: Floats) -> Floats:
    """Place, mm, and turn as a vector, degrees, of a motion."""
    turn = pose[:3, :3]
    angle = np.arccos(np.clip(0.5 * (np.trace(turn) - 1.0), -1.0, 1.0))
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    return np.concatenate([pose[:3, 3], np.degrees(angle) * axis / (2.0 * np.sin(angle))])


def _on_board(pose: Floats, fine: int) -> Floats:
    """(h · fine, w · fine, 3) where the rays of a camera meet the board's plane, in the camera's frame."""
    steps = (np.arange(fine) + 0.5) / fine - 0.5
    rows, columns = ((np.arange(n)[:, None] + steps).ravel() for n in CAMERA.shape)
    rays = CAMERA.rays(np.stack(np.broadcast_arrays(columns, rows[:, None]), axis=-1))
    normal, origin = pose[:3, 2], pose[:3, 3]
    return np.asarray(rays * ((origin @ normal) / (rays @ normal))[..., None])


def _drawn(pose: Floats) -> Floats:
    """(h, w) how bright the board is, 0.06 to 1."""
    place = (_on_board(pose, _FINE) - pose[:3, 3]) @ pose[:3, :2] / BOARD.square_mm
    squares = np.floor(place).astype(int) + 1
    inside = ((squares >= 0) & (squares <= (BOARD.columns, BOARD.rows))).all(axis=-1)
    dark = inside & (squares.sum(axis=-1) % 2 == 0)
    height, width = CAMERA.shape
    return np.asarray(np.where(dark, 0.06, 1.0).reshape(height, _FINE, width, _FINE).mean(axis=(1, 3)))


def _noisy(light: Floats, rng: np.random.Generator) -> Image:
    seen = light + _BLACK + rng.normal(scale=_NOISE_DN, size=light.shape)
    return np.clip(np.rint(seen), 0.0, 255.0).astype(np.uint16)


class _BoardScanner:
    """A camera and a projector before a chessboard."""

    def __init__(self, pose: Floats, *, seed: int) -> None:
        turn = np.arctan2(_BASELINE_MM, _DISTANCE_MM)
        to_projector = exponential(np.array([0.0, turn, 0.0, 0.0, 0.0, 0.0]))
        to_projector[:3, 3] = (-_BASELINE_MM, 0.0, 0.0)
        self.rig = Rig(CAMERA, _PROJECTOR, to_projector)
        self.camera = CameraSheet(bit_depth=8, black_level_dn=_BLACK, exposure_range_ms=(0.5, 2.0))
        self.projector = ProjectorSheet(np.linspace(0.0, 1.0, 256))
        self._bright = _drawn(pose)
        there = _on_board(pose, 1) @ to_projector[:3, :3].T + to_projector[:3, 3]
        column, row = np.moveaxis(np.rint(_PROJECTOR.project(there)).astype(int), -1, 0)
        self._lit = (column >= 0) & (column < _PROJECTOR.width) & (row >= 0) & (row < _PROJECTOR.height)
        self._column, self._row = np.where(self._lit, column, 0), np.where(self._lit, row, 0)
        self._rng = np.random.default_rng(seed)

    def capture(self, patterns: Patterns, exposure_ms: float) -> Image:
        shown = patterns.frames[:, self._row, self._column] / 255.0 * self._lit
        return np.stack(
            [_noisy(_WHITE * exposure_ms * self._bright * one, self._rng) for one in np.asarray(shown)]
        )
