"""Calibrations that other people's tools wrote with OpenCV's ``FileStorage`` (XML or YAML)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np

from burrscan.arrays import Floats
from burrscan.errors import InputError
from burrscan.pose import rigid
from burrscan.rig import Rig, View

_NAMES = {
    "camera": ("cam_int", "cam_K", "camera_matrix", "M1"),
    "camera distortion": ("cam_dist", "cam_kc", "dist_coeffs", "D1"),
    "projector": ("proj_int", "proj_K", "M2"),
    "projector distortion": ("proj_dist", "proj_kc", "D2"),
    "rotation": ("rotation", "roration", "R"),
    "translation": ("translation", "T"),
}
"""What is needed, and the names it goes by: procam-calibration, Moreno & Taubin's tool, OpenCV's samples."""


def read_opencv_rig(
    path: Path, *, projector: tuple[int, int], camera: tuple[int, int], unit_mm: float = 1.0
) -> Rig:
    """Read a stereo calibration of camera and projector.

    Parameters
    ----------
    path
        The file.
    projector, camera
        Width and height of both, which such files do not hold.
    unit_mm
        Millimetres per unit of its translation.

    Raises
    ------
    InputError
        For a file that is no FileStorage, lacks a matrix, or has one of the wrong shape.

    """
    found = _matrices(path)
    pose = np.eye(4)
    pose[:3, :3] = _shaped(found, "rotation", (3, 3), path)
    pose[:3, 3] = _shaped(found, "translation", (3,), path) * unit_mm
    rigid(pose, what=f"{path}: rotation and translation")
    return Rig(_view(found, "camera", camera, path), _view(found, "projector", projector, path), pose)


def _matrices(path: Path) -> dict[str, Floats]:
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    try:
        storage: Any = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    except (cv2.error, SystemError) as error:
        raise InputError(f"{path}: not a file of OpenCV's FileStorage") from error
    if not storage.isOpened():
        raise InputError(f"{path}: not a file of OpenCV's FileStorage")
    found: dict[str, Floats] = {}
    for what, names in _NAMES.items():
        for name in names:
            matrix = storage.getNode(name).mat()
            if matrix is not None and what not in found:
                found[what] = np.asarray(matrix, dtype=float)
    storage.release()
    missing = [f"{what} ({' or '.join(names)})" for what, names in _NAMES.items() if what not in found]
    if missing:
        raise InputError(f"{path}: lacks {'; '.join(missing)}")
    return found


def _shaped(found: dict[str, Floats], what: str, shape: tuple[int, ...], path: Path) -> Floats:
    matrix = found[what]
    if matrix.size != np.prod(shape):
        raise InputError(f"{path}: {what} has shape {matrix.shape}, not {shape}")
    return matrix.reshape(shape)


def _view(found: dict[str, Floats], device: str, size: tuple[int, int], path: Path) -> View:
    matrix = _shaped(found, device, (3, 3), path)
    given = found[f"{device} distortion"].ravel()
    if not 4 <= len(given) <= 5:
        raise InputError(f"{path}: {device} distortion has {len(given)} coefficients; 4 or 5 are known here")
    k1, k2, p1, p2, k3 = (float(k) for k in (*given, 0.0)[:5])
    return View(
        width=size[0],
        height=size[1],
        fx=float(matrix[0, 0]),
        fy=float(matrix[1, 1]),
        cx=float(matrix[0, 2]),
        cy=float(matrix[1, 2]),
        distortion=(k1, k2, p1, p2, k3),
    )
