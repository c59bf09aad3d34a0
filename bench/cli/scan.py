"""``burrscan scan``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from bench.cli.grammar import add_json, add_trust, raster
from bench.cli.output import json_beside, told

SUMMARY = "decode, triangulate and mesh a capture folder, rendered or real"
DETAILS = """\
FOLDER is a capture folder (burrscan/captures/README.md), rendered by `burrscan render` or recorded,
a plain Gray-code folder as OpenCV's tools record it (graycode_00.png, graycode_01.png, ..., with
inverses or without), or phase steps of several frequencies with a manifest that says which.
The strategy is the one that capture.json names. The PLY carries a float property 'sigma_mm' per
vertex: the stated standard deviation along the camera's ray. `burrscan detect` reads it."""

EXAMPLES = """\
  burrscan scan captures/paper --ply paper.ply
  burrscan scan captures/procam/capture_0 --gray 1024x768 --rig calibration_result.xml --ply board.ply"""


def options(parser: argparse.ArgumentParser) -> None:
    """What it takes."""
    parser.add_argument("folder", metavar="FOLDER", type=Path, help="a capture folder")
    parser.add_argument("--ply", metavar="FILE", type=Path, help="write the mesh as PLY")
    add_json(parser, "the summary")
    parser.add_argument("--scan", metavar="METHOD", help="strategy (default: as recorded)")
    parser.add_argument("--gray", metavar="WxH", type=raster, help="plain Gray code; the projector's raster")
    parser.add_argument("--sheets", metavar="FILE", type=Path, help="measured sheets.json of both devices")
    parser.add_argument("--rig", metavar="FILE", type=Path, help="rig.json, or OpenCV's XML or YAML")
    add_trust(parser, "capture.json")


def main(given: argparse.Namespace) -> int:
    """Scan, print the summary, and write what is asked for."""
    from burrscan.captures.gray_folder import is_gray_folder
    from burrscan.captures.phase_folder import is_phase_folder

    if given.gray is not None or is_gray_folder(given.folder):
        summary, surface = _gray(given)
    else:
        summary, surface = _phase(given) if is_phase_folder(given.folder) else _capture(given)
    _refuse_empty(given.folder, summary)
    with told(given.json):
        for name, value in summary.items():
            print(f"{name:<18}{_text(value)}")
    with json_beside(given.json, summary):
        if given.ply:
            _write_ply(given.ply, surface)
    return 0


def _refuse_empty(folder: Path, summary: dict[str, Any]) -> None:
    from burrscan.errors import InputError

    if not summary["accepted"]:
        raise InputError(f"{folder}: no pixel decodes; do patterns and pictures belong together?")
    if summary.get("points", 1) == 0:
        raise InputError(
            f"{folder}: {summary['accepted']} pixels decode, but none of them is a point of a surface: "
            "does the rig belong to this capture?"
        )


def _capture(given: argparse.Namespace) -> tuple[dict[str, Any], Any]:
    from burrscan.captures.folder import read_rig
    from burrscan.captures.replay import replay
    from burrscan.captures.sheets import read_sheets
    from burrscan.meshing import surface as surface_of
    from burrscan.sideways import quarter_turned, runs_along_columns

    sheets = read_sheets(given.sheets) if given.sheets else None
    scan, scanner = replay(given.folder, method=given.scan, sheets=sheets, trusted=given.trust)
    rig = read_rig(given.rig) if given.rig else scanner.rig
    told = quarter_turned(rig) if runs_along_columns(scanner.rig) else rig
    surface = surface_of(scan.correspondence, told, radiance=scan.radiance)
    summary = {
        "folder": str(given.folder),
        "strategy": given.scan or (scanner.scan.method if scanner.scan else "found by its shots"),
        "frames": scan.frames,
        "exposures_ms": list(scan.exposures_ms),
        "saturated_pixels": int(scan.saturated.sum()),
    }
    return summary | _decoded(scan.correspondence) | _meshed(surface), surface


def _gray(given: argparse.Namespace) -> tuple[dict[str, Any], Any]:
    from burrscan.captures.gray_folder import decode_gray_capture, read_gray_folder
    from burrscan.captures.sheets import read_sheets
    from burrscan.errors import InputError

    if given.gray is None:
        raise InputError(
            f"{given.folder}: a plain Gray-code folder; say the projector's raster: --gray 1024x768"
        )
    width, height = given.gray
    camera = read_sheets(given.sheets)[0] if given.sheets else None
    capture = read_gray_folder(given.folder, width=width, height=height, camera=camera)
    correspondence = decode_gray_capture(capture)
    summary: dict[str, Any] = {
        "folder": str(given.folder),
        "strategy": f"gray {width}x{height}",
        "bits": _BITS[capture.told_by],
        "frames": len(capture.columns) + len(capture.rows) + (0 if capture.told_by == "own range" else 2),
    }
    return _measured(given, summary, correspondence, given.rig, (width, height))


_BITS = {
    "inverses": "told by their inverses",
    "white and black": "no inverses: told by a threshold, the middle of white and black of each pixel",
    "own range": "no inverses, white or black: told by a threshold, the middle of each pixel's own range",
}


def _phase(given: argparse.Namespace) -> tuple[dict[str, Any], Any]:
    from burrscan.captures.phase_folder import decode_phase_capture, read_phase_folder
    from burrscan.captures.sheets import read_sheets

    camera = read_sheets(given.sheets)[0] if given.sheets else None
    capture = read_phase_folder(given.folder, camera=camera)
    document = capture.document
    axes = [axis for axis in (document.columns, document.rows) if axis]
    summary: dict[str, Any] = {
        "folder": str(given.folder),
        "strategy": "phase steps: "
        + ", ".join(f"{len(axis.frequencies)} frequencies × {axis.steps} steps" for axis in axes),
        "frames": sum(axis.pictures for axis in axes),
    }
    beside = given.folder / "rig.json"
    rig = given.rig or (beside if beside.exists() else None)
    raster = (document.projector.width, document.projector.height)
    return _measured(given, summary, decode_phase_capture(capture), rig, raster)


def _measured(
    given: argparse.Namespace,
    summary: dict[str, Any],
    correspondence: Any,
    rig: Path | None,
    raster: tuple[int, int],
) -> tuple[dict[str, Any], Any]:
    """The summary with what was decoded, and the surface where there is a calibration."""
    from burrscan.errors import InputError
    from burrscan.meshing import surface as surface_of
    from burrscan.sideways import along_baseline

    summary |= _decoded(correspondence)
    if rig is None:
        if given.ply:
            raise InputError("points need a calibration: give --rig rig.json, or OpenCV's XML or YAML")
        return summary, None
    calibration = _rig(rig, raster, correspondence.mask.shape[::-1])
    surface = surface_of(*along_baseline(correspondence, calibration))
    return summary | _meshed(surface), surface


def _rig(path: Path, projector: tuple[int, int], camera: tuple[int, ...]) -> Any:
    from burrscan.captures.folder import read_rig
    from burrscan.captures.opencv import read_opencv_rig
    from burrscan.errors import InputError

    if path.suffix.lower() != ".json":
        return read_opencv_rig(path, projector=projector, camera=(camera[0], camera[1]))
    rig = read_rig(path)
    for name, view, size in (("camera", rig.camera, camera), ("projector", rig.projector, projector)):
        if (view.width, view.height) != tuple(size):
            raise InputError(
                f"{path}: its {name} has {view.width}×{view.height} pixels, the capture's {size[0]}×{size[1]}"
            )
    return rig


def _decoded(correspondence: Any) -> dict[str, Any]:
    import numpy as np

    mask = correspondence.mask
    accepted = int(mask.sum())
    sigma = float(np.median(correspondence.sigma_u_px[mask])) if accepted else None
    return {"pixels": mask.size, "accepted": accepted, "median_sigma_px": sigma}


def _meshed(surface: Any) -> dict[str, Any]:
    import numpy as np

    points = len(surface.vertices_mm)
    return {
        "points": points,
        "faces": len(surface.faces),
        "median_sigma_mm": float(np.median(surface.vertex_sigma_mm)) if points else None,
        "median_depth_mm": float(np.median(surface.vertices_mm[:, 2])) if points else None,
    }


def _text(value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(_text(item) for item in value)
    if value is None:
        return "–"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _write_ply(path: Path, surface: Any) -> None:
    from burrscan.ply import write_ply

    write_ply(path, surface.vertices_mm, surface.faces, scalars={"sigma_mm": surface.vertex_sigma_mm})
