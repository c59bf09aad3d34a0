"""Meshes from files, and results to files."""

from __future__ import annotations

import json
import math
import warnings
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from burrscan.arrays import Bools, Floats, Ints32, Levels, freeze
from burrscan.errors import InputError
from burrscan.files import written_whole
from burrscan.inspection import Burr, Inspection, Value
from burrscan.meshbytes import mesh_bytes
from burrscan.ply import write_ply
from burrscan.variants import suggest

UNITS_MM = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4, "um": 0.001}
"""Millimetres per unit."""
FORMATS = (".ply", ".stl", ".obj")
SCHEMA = "burrscan-inspection/1"
"""Version of :func:`inspection_document`."""


@dataclass(frozen=True)
class MeshData:
    """A mesh as read.

    Parameters
    ----------
    vertices_mm, faces
        (V, 3) finite and (T, 3); a cloud has no faces.
    notices
        What was dropped or guessed while reading, one sentence each.
    sigma_mm
        (V,) standard deviation of the vertices, where a PLY has the property ``sigma_mm``, as
        ``burrscan scan`` and ``burrscan merge`` write it; None where it has not.

    """

    vertices_mm: Floats
    faces: Ints32
    notices: tuple[str, ...] = ()
    sigma_mm: Floats | None = None

    def __post_init__(self) -> None:
        freeze(self, vertices_mm=self.vertices_mm, faces=self.faces, sigma_mm=self.sigma_mm)


def read_mesh(path: Path, *, unit: str = "mm") -> MeshData:
    """Read a PLY, STL or OBJ file.

    Parameters
    ----------
    path
        The file; its suffix says which, in any case.
    unit
        A key of :data:`UNITS_MM`: what one unit of the file's coordinates is.

    Raises
    ------
    InputError
        For an unknown unit or suffix, a file that is not there, broken or without vertices.

    """
    if unit not in UNITS_MM:
        raise InputError(f"unknown unit '{unit}': {suggest(unit, list(UNITS_MM))}")
    vertices, faces, sigma = _loaded(Path(path))
    if not len(vertices):
        raise InputError(f"{path}: holds no vertices")
    return _cleaned(vertices * UNITS_MM[unit], faces, sigma)


def _loaded(path: Path) -> tuple[Floats, Ints32, Floats | None]:
    if not path.is_file():
        raise InputError(f"{path}: {'is a folder' if path.is_dir() else 'no such file'}")
    if path.suffix.lower() not in FORMATS:
        raise InputError(f"{path}: '{path.suffix}' is no mesh format known here; known: {', '.join(FORMATS)}")
    content = mesh_bytes(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            loaded = trimesh.load(
                content, file_type=path.suffix[1:].lower(), process=False, maintain_order=True
            )
            parts = list(loaded.geometry.values()) if isinstance(loaded, trimesh.Scene) else [loaded]
            surfaces = all(isinstance(part, trimesh.Trimesh | trimesh.PointCloud) for part in parts)
            read = (*_stacked(parts), _stated_sigma(parts)) if surfaces else None
    except Exception as error:
        raise InputError(f"{path}: cannot be read as {path.suffix[1:].upper()}: {error}") from error
    if read is None:
        raise InputError(f"{path}: holds lines, no surface")
    return read


def _stated_sigma(parts: list[Any]) -> Floats | None:
    """The vertex property ``sigma_mm`` of a PLY, which is in mm whatever the unit of the coordinates."""
    if len(parts) != 1:
        return None
    vertex = parts[0].metadata.get("_ply_raw", {}).get("vertex", {})
    if "sigma_mm" not in vertex.get("properties", {}):
        return None
    sigma = np.asarray(vertex["data"]["sigma_mm"], dtype=np.float64).ravel()
    return sigma if len(sigma) == len(parts[0].vertices) else None


def _stacked(parts: list[Any]) -> tuple[Floats, Ints32]:
    """One mesh of a file's parts; the faces of each count from its own first vertex."""
    vertices, faces, before = [np.empty((0, 3))], [np.empty((0, 3), np.int32)], 0
    for part in parts:
        vertices.append(np.asarray(part.vertices, dtype=np.float64).reshape(-1, 3))
        own = getattr(part, "faces", None)
        if own is not None and len(own):
            faces.append(np.asarray(own, dtype=np.int32).reshape(-1, 3) + np.int32(before))
        before += len(vertices[-1])
    return np.concatenate(vertices), np.concatenate(faces).astype(np.int32)


def _cleaned(vertices: Floats, faces: Ints32, sigma: Floats | None) -> MeshData:
    """Without vertices that are not numbers, and without faces that name none."""
    notices = []
    inside = ((faces >= 0) & (faces < len(vertices))).all(axis=1)
    if not inside.all():
        notices.append(f"{int((~inside).sum())} faces name vertices that do not exist: dropped")
        faces = faces[inside]
    finite: Bools = np.logical_and.reduce(np.isfinite(vertices), axis=1)
    if not finite.all():
        notices.append(f"{int((~finite).sum())} of {len(vertices)} vertices are not finite numbers: dropped")
        number = np.cumsum(finite, dtype=np.int32) - np.int32(1)
        faces = number[faces[finite[faces].all(axis=1)]]
        vertices, sigma = vertices[finite], None if sigma is None else sigma[finite]
    if not len(vertices):
        raise InputError("the mesh holds no finite vertices")
    if not len(faces):
        notices.append("no faces: read as a cloud of vertices")
    return MeshData(np.ascontiguousarray(vertices), np.ascontiguousarray(faces), tuple(notices), sigma)


def write_deviation_ply(
    path: Path, vertices_mm: Floats, faces: Ints32, deviation_mm: Floats, *, sigma_mm: Floats | None = None
) -> None:
    """Write a binary PLY with a float property ``deviation_mm``, ``sigma_mm`` where it is known, and colours.

    Colours run from blue (material missing) over white to red (material too much), full at the 99.5 % point
    of the deviations' size; grey where none is stated. MeshLab, CloudCompare and Blender show either.
    """
    write_ply(
        path,
        vertices_mm,
        faces,
        scalars={"deviation_mm": deviation_mm} | ({} if sigma_mm is None else {"sigma_mm": sigma_mm}),
        colours=_colours(deviation_mm),
        comment="coordinates and deviation in millimetres",
    )


def _colours(deviation_mm: Floats) -> Levels:
    known = np.isfinite(deviation_mm)
    reach = float(np.quantile(np.abs(deviation_mm[known]), 0.995)) if known.any() else 1.0
    share = np.clip(np.nan_to_num(deviation_mm) / max(reach, 1e-12), -1.0, 1.0)[:, None]
    blue, white, red = np.array([33, 102, 172]), np.array([247, 247, 247]), np.array([178, 24, 43])
    colours = np.where(share < 0.0, white + share * (white - blue), white - share * (white - red))
    colours[~known] = 128
    rounded: Levels = np.round(colours).astype(np.uint8)
    return rounded


def inspection_document(inspection: Inspection) -> dict[str, Any]:
    """An inspection as a plain document for JSON; units are in the keys, what is not stated is null.

    Keys: ``schema``; ``axis`` (point_mm, direction, sigma_deg, covariance, method, evaluations,
    undetermined, gross_probability); ``T_part_mesh`` (4×4, rows); ``generatrix`` (z_mm, r_mm, sigma_mm,
    band_mm; null between pieces, material to the right of the curve's direction); ``burrs``, each with side,
    T_mesh_burr, significance, within_limit and the values angle_deg, z_start_mm, z_end_mm, height_mm,
    width_mm, length_mm, area_mm2, volume_mm3 as ``{"value": …, "sigma": …}``; ``deviation`` (rms_mm,
    least_mm, greatest_mm, vertices, without); ``checks`` (name, passed, value, limit, unit, reason);
    ``timings_s``. The deviation of each vertex is in the PLY.
    """
    axis, curve = inspection.axis, inspection.generatrix
    document = {
        "schema": SCHEMA,
        "axis": {
            "point_mm": axis.point_mm,
            "direction": axis.direction,
            "sigma_deg": axis.sigma_deg,
            "covariance": axis.covariance,
            "method": axis.method,
            "evaluations": axis.evaluations,
            "undetermined": axis.undetermined,
            "gross_probability": axis.gross_probability,
        },
        "T_part_mesh": inspection.T_part_mesh,
        "generatrix": {name: getattr(curve, name) for name in ("z_mm", "r_mm", "sigma_mm", "band_mm")},
        "burrs": [_burr_document(burr) for burr in inspection.burrs],
        "deviation": _deviation_document(inspection.deviation_mm),
        "checks": [asdict(check) for check in inspection.checks],
        "timings_s": dict(inspection.timings_s),
    }
    return {key: _plain(value) for key, value in document.items()}


def _burr_document(burr: Burr) -> dict[str, Any]:
    return {name: getattr(burr, name) for name in burr.__dataclass_fields__}


def _deviation_document(deviation_mm: Floats) -> dict[str, Any]:
    known = deviation_mm[np.isfinite(deviation_mm)]
    some = len(known) > 0
    return {
        "rms_mm": float(np.sqrt((known**2).mean())) if some else None,
        "least_mm": float(known.min()) if some else None,
        "greatest_mm": float(known.max()) if some else None,
        "vertices": len(deviation_mm),
        "without": len(deviation_mm) - len(known),
    }


def _plain(value: Any) -> Any:
    """Arrays to lists, values to tables, numbers that JSON does not know to null."""
    if isinstance(value, Value):
        return {"value": _plain(value.value), "sigma": _plain(value.sigma)}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def write_inspection_json(path: Path, inspection: Inspection) -> None:
    """Write :func:`inspection_document` as JSON."""
    with written_whole(Path(path)) as beside:
        beside.write_text(json.dumps(inspection_document(inspection), indent=1) + "\n", "utf-8")
