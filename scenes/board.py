"""Flat boards in front of the rig: a chessboard to calibrate with, an even one for ramps."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from burrscan.arrays import Floats, Floats32, Image
from burrscan.calibration.board import Board
from burrscan.captures import RecordingScanner
from burrscan.captures.document import ScanDocument
from burrscan.scan.rivals.rows_and_columns import scan_rows_and_columns
from scenes.electronics.sensor import expose
from scenes.electronics.spec import CameraSpec, ProjectorSpec
from scenes.renderer import activate
from scenes.scanner import SimulatedScanner
from scenes.scene import SceneSpec
from scenes.simulate import optics_of
from scenes.transport.matrix import LightTransport
from scenes.transport.optics import Optics
from scenes.transport.trace import trace

_MARGIN = 2  # squares between the outermost corners and the rim: one of the pattern, one white


@dataclass(frozen=True)
class BoardSpec:
    """A printed, matte board.

    Parameters
    ----------
    board
        Its corners.
    white, black
        Diffuse reflectances; equal ones make an even board.

    """

    board: Board
    white: float = 0.8
    black: float = 0.05

    def texture(self) -> Floats32:
        """(rows, columns) reflectance of each square, the white rim included."""
        height, width = self.board.rows + 2 * _MARGIN - 1, self.board.columns + 2 * _MARGIN - 1
        y, x = np.mgrid[:height, :width]
        inside = (y > 0) & (y < height - 1) & (x > 0) & (x < width - 1)
        return np.where(inside & ((x + y) % 2 == 0), self.black, self.white).astype(np.float32)


def board_poses(board: Board, *, count: int, seed: int, standoff_mm: float, reach_mm: float) -> list[Floats]:
    """Poses T_camera_board (4, 4): tilts of 15 to 35 degrees in all directions, spread over the field.

    Parameters
    ----------
    board
        Its middle is what is placed.
    count
        How many.
    seed
        Of their scatter.
    standoff_mm, reach_mm
        Distance of the middle of the field, and how far the boards stray from it sideways (and in depth).

    """
    rng = np.random.default_rng(seed)
    middle = board.points_mm.mean(axis=0)
    poses = []
    for i in range(count):
        azimuth = 2.0 * np.pi * (i + rng.uniform(0.0, 0.5)) / count
        tilt = np.radians(rng.uniform(15.0, 35.0))
        lean = Rotation.from_rotvec(tilt * np.array([np.cos(azimuth), np.sin(azimuth), 0.0]))
        turn = Rotation.from_rotvec([0.0, 0.0, np.radians(rng.uniform(-20.0, 20.0))])
        pose = np.eye(4)
        pose[:3, :3] = (lean * turn).as_matrix()
        pose[:3, 3] = (0.0, 0.0, standoff_mm) - pose[:3, :3] @ middle
        pose[:3, 3] += rng.uniform(-1.0, 1.0, 3) * reach_mm
        poses.append(pose)
    return poses


def board_light(
    spec: BoardSpec, T_camera_board: Floats, optics: Optics, *, samples: int = 16, seed: int = 0
) -> LightTransport:
    """Trace the light between projector, board and camera: direct light alone, a plane lights nothing else.

    Raises
    ------
    burrscan.errors.InputError
        When no vectorised renderer runs here.

    """
    mi = activate()
    scene = mi.load_dict({"type": "scene", "board": _mesh(mi, spec, T_camera_board)})
    return trace(mi, scene, optics, samples=samples, bounces=1, seed=seed)


def _mesh(mi: Any, spec: BoardSpec, T_camera_board: Floats) -> Any:
    """Two triangles with a texel per square, looked up without a filter: edges are exact."""
    bitmap = {
        "type": "bitmap",
        "bitmap": mi.Bitmap(spec.texture()[..., None]),
        "raw": True,
        "filter_type": "nearest",
    }
    properties = mi.Properties()
    properties["mesh_bsdf"] = mi.load_dict(
        {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": bitmap}}
    )
    mesh = mi.Mesh("board", 4, 2, has_vertex_texcoords=True, props=properties)
    height, width = spec.texture().shape
    unit = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    flat = (unit * (width, height) - _MARGIN) * spec.board.square_mm
    corners = np.hstack([flat, np.zeros((4, 1))]) @ T_camera_board[:3, :3].T + T_camera_board[:3, 3]
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = corners.astype(np.float32).ravel()
    # Mitsuba counts texture rows from the bottom: v = 1 is the first row of the bitmap
    parameters["vertex_texcoords"] = (
        np.stack([unit[:, 0], 1.0 - unit[:, 1]], axis=-1).astype(np.float32).ravel()
    )
    parameters["faces"] = np.array([0, 1, 2, 0, 2, 3], np.uint32)
    parameters.update()
    return mesh


def board_images(
    light: LightTransport,
    levels: Any,
    *,
    camera: CameraSpec,
    projector: ProjectorSpec,
    exposure_ms: float,
    identity: tuple[int, ...],
    ambient: float = 0.002,
) -> Image:
    """What the camera sees (F, h, w) of a board under frames of projector levels (F, H, W)."""
    shown = projector.sheet.light.astype(np.float32)[levels]
    received = light.relight(shown) + np.float32(ambient)
    return expose(received, camera=camera, exposure_ms=exposure_ms, identity=identity, first_frame=0)


def write_coded_boards(
    scene: SceneSpec,
    folder: Path,
    *,
    board: Board,
    count: int,
    code: str = "gray_phase",
    seed: int = 0,
) -> list[Path]:
    """Record boards in front of a scene's rig, a capture folder ``00``, ``01``, … each.

    Parameters
    ----------
    scene
        Its rig, electronics and light; its wheel is not there.
    folder
        Where the captures go.
    board, count
        What is shown, and in how many poses.
    code
        A code family for the strategy ``both``.
    seed
        Of poses and noise.

    Raises
    ------
    burrscan.errors.InputError
        When the code is unknown, or no vectorised renderer runs here.

    """
    optics, written = optics_of(scene), []
    reach_mm = 0.04 * scene.rig.standoff_mm
    poses = board_poses(board, count=count, seed=seed, standoff_mm=scene.rig.standoff_mm, reach_mm=reach_mm)
    for i, pose in enumerate(poses):
        light = board_light(BoardSpec(board), pose, optics, samples=scene.render.samples, seed=i)
        scanner = SimulatedScanner(light, scene=scene, rig=scene.rig.rig(), identity=(seed, i))
        given = {"code": code, "parameters": {}}
        recorder = RecordingScanner(scanner, folder / f"{i:02d}", scan=ScanDocument("both", given))
        scan_rows_and_columns(recorder, code=code)
        recorder.close()
        written.append(folder / f"{i:02d}")
    return written
