"""Views from files, and their aligned poses to a file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field
from pydantic.dataclasses import dataclass

from burrscan.arrays import Floats
from burrscan.documents import STRICT, build, read_json
from burrscan.errors import InputError
from burrscan.meshio import read_mesh
from burrscan.pose import rigid
from burrscan.registration.alignment import Alignment, Free, PosedSurface

Sigma = Annotated[float, Field(ge=1e-6, le=1e6)]  # from a nanometre to a kilometre; squares stay numbers
Row = tuple[float, float, float, float]


@dataclass(frozen=True, config=STRICT)
class PosesFile:
    """The rough poses of several views, in the order of the meshes, and how good they are (one sigma)."""

    T_world_camera: tuple[tuple[Row, Row, Row, Row], ...]
    sigma_mm: Sigma = 0.5
    sigma_deg: Sigma = 0.2


def read_views(meshes: Sequence[Path], poses: Path) -> tuple[list[PosedSurface], float, float]:
    """Read views and their rough poses.

    Returns
    -------
    views, sigma_mm, sigma_deg
        What :func:`burrscan.registration.align` asks for.

    Raises
    ------
    InputError
        For a file that cannot be read, or another number of poses than of meshes.

    """
    document = read_json(poses)
    if not isinstance(document, dict):
        raise InputError(f"{poses}: not a JSON object with T_world_camera")
    told = build(PosesFile, document, source=str(poses))
    if len(told.T_world_camera) != len(meshes):
        raise InputError(f"{poses}: {len(told.T_world_camera)} poses for {len(meshes)} meshes")
    known = [
        rigid(np.array(pose), what=f"{poses}: T_world_camera {number}")
        for number, pose in enumerate(told.T_world_camera)
    ]
    views = [_view(path, pose) for path, pose in zip(meshes, known, strict=True)]
    return views, told.sigma_mm, told.sigma_deg


def alignment_document(found: Alignment) -> dict[str, Any]:
    """The aligned poses, their covariances and overlaps as a plain document for JSON."""
    return {
        "schema": "burrscan-alignment/1",
        "T_world_camera": found.T_world_camera.tolist(),
        "covariance": found.covariance.tolist(),
        "moved_mm": found.moved_mm.tolist(),
        "overlap": found.overlap.tolist(),
        "rms_mm": found.rms_mm,
        "floor_mm": found.floor_mm,
        "noise_mm": found.noise_mm.tolist(),
        "working_mm": found.working_mm,
        "free": [[_free(motion) for motion in motions] for motions in found.free],
        "iterations": found.iterations,
    }


def _free(motion: Free) -> dict[str, Any]:
    return {
        "kind": motion.kind,
        "point_mm": motion.point_mm.tolist(),
        "direction": motion.direction.tolist(),
        "sigma": motion.sigma,
    }


def _view(path: Path, pose: Floats) -> PosedSurface:
    mesh = read_mesh(path)
    if mesh.sigma_mm is not None:
        return PosedSurface(mesh.vertices_mm, mesh.faces, mesh.sigma_mm, pose)
    return PosedSurface(mesh.vertices_mm, mesh.faces, np.full(len(mesh.vertices_mm), np.nan), pose)
