"""Calibrations from rendered captures against the truth: ``python -m bench.checks.calibration``.

Photometry: ramps of a white board by a linear, a bent and a colour camera, some seeds each. Geometry: boards
in some codes, by a rig with bent lenses and shifted axes. One line per case, worst over the seeds.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from burrscan.arrays import Floats
from burrscan.calibration.board import Board
from burrscan.calibration.geometric import calibrate_captures
from burrscan.calibration.photometric import Photometry, calibrate_photometry
from burrscan.captures.board_folder import read_board_folder
from burrscan.captures.ramps import read_ramps
from burrscan.rig import Rig
from scenes.board import write_coded_boards
from scenes.ramp_folder import write_ramps
from scenes.scene import SceneSpec, scene_from

CAMERA_MIX = [[1.0, 0.12, 0.03], [0.08, 1.0, 0.10], [0.02, 0.15, 1.0]]
"""Crosstalk of usual size and no symmetry, so that a transposed answer shows."""
PROJECTOR_MIX = [[1.0, 0.06, 0.01], [0.10, 1.0, 0.07], [0.02, 0.09, 1.0]]
"""The same of the projector, and other numbers, so that one taken for the other shows."""
LENS = [-0.15, 0.1, 0.001, -0.001, 0.0]
"""k1, k2, p1, p2, k3 of a usual lens: the corner of the picture moves by some per cent."""
BENT = {"black_level_dn": 20.0, "vignetting": 0.2, "response": {"gamma": 0.6}}
"""A camera whose response and vignetting are far from none."""
PHOTOMETRY: dict[str, dict[str, Any]] = {
    "linear, 10 bits": {},
    "gamma 0.6, 10 bits, vignetting": {"camera": BENT, "projector": {"gamma": 1.8, "vignetting": 0.2}},
    "linear-logarithmic, 12 bits": {
        "camera": {"bit_depth": 12, "black_level_dn": 40.0, "response": {"knee": 0.3}}
    },
    "gamma 0.6, 8 bits": {"camera": BENT | {"bit_depth": 8, "black_level_dn": 8.0}},
    "colour, gamma 0.6": {
        "camera": BENT | {"crosstalk": CAMERA_MIX},
        "projector": {"crosstalk": PROJECTOR_MIX},
    },
    "colour, flicker of 0.3 %": {
        "camera": BENT | {"crosstalk": CAMERA_MIX},
        "projector": {"crosstalk": PROJECTOR_MIX, "flicker": 0.003},
    },
}
"""Name of a row of the table, and what differs from the default scene."""
CODES = ("gray_phase", "xor_phase", "micro_phase", "heterodyne")
BOARD = Board(9, 6, 20.0)


def scene(scale: float, tables: dict[str, Any]) -> SceneSpec:
    """A scene with the default rig at a scale."""
    rig = {"scale": scale} | tables.get("rig", {})
    tables = {"render": {"samples": 64}} | tables  # edges that run along the raster need many
    return scene_from(
        {"wheel": "paper", "finish": "matte"} | tables | {"rig": rig}, source="calibration check"
    )


def photometry(spec: SceneSpec, folder: Path, seed: int) -> Photometry:
    """Render ramps and calibrate."""
    capture = read_ramps(write_ramps(spec, folder, seed=seed))
    return calibrate_photometry(capture.lamps, capture.levels, bit_depth=capture.bit_depth)


def photometric_errors(spec: SceneSpec, found: Photometry) -> Floats:
    """Largest errors: camera and projector curves (share of full scale), crosstalk of both, full well."""
    camera, projector = spec.camera, spec.projector
    black = camera.black_level_dn
    truth = np.array(camera.response.light_of_dn(bit_depth=camera.bit_depth, black_level_dn=black))
    above = int(np.ceil(black))
    curve = max(float(np.abs(one.light - truth)[above:].max()) for one in found.camera)
    light = max(float(np.abs(s.light - projector.sheet.light).max()) for s in found.projector.sheets)
    mixes = [
        float(np.abs(mix - np.array(true)).max()) if true else 0.0
        for mix, true in ((found.camera_mix, camera.crosstalk), (found.projector_mix, projector.crosstalk))
    ]
    return np.array([curve, light, *mixes, abs(found.full_well_e / camera.full_well_e - 1.0)])


def geometric_line(code: str, spec: SceneSpec, folder: Path) -> str:
    """Render boards in a code, calibrate, and compare with the true rig."""
    folders = write_coded_boards(spec, folder, board=BOARD, count=8, code=code)
    seen = [read_board_folder(one) for one in folders]
    captures = [(f.name, s.white, s.correspondence) for f, s in zip(folders, seen, strict=True)]
    found, _ = calibrate_captures(captures, BOARD, camera=seen[0].camera, projector=seen[0].projector)
    off = found.values - _values(spec.rig.rig())
    distance = float(off @ np.linalg.solve(found.covariance, off)) / len(off)
    worst = float(np.abs(off / found.sigma).max())
    rms = found.rms_px.max(axis=0)
    baseline = found.rig.baseline_mm - spec.rig.rig().baseline_mm
    return (
        f"| {code} | {rms[0]:.3f} | {rms[1]:.3f} | {distance:.2f} | {worst:.1f} | {1000.0 * baseline:+.0f} |"
    )


def _values(rig: Rig) -> Floats:
    devices = [[v.fx, v.fy, v.cx, v.cy, *v.distortion[:4]] for v in (rig.camera, rig.projector)]
    turn = cv2.Rodrigues(rig.T_projector_camera[:3, :3])[0].ravel()
    return np.concatenate([*devices, turn, rig.T_projector_camera[:3, 3]])


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scale", type=float, default=0.5, help="of both rasters (default: 0.5)")
    parser.add_argument("--seeds", type=int, default=3, help="per photometric case (default: 3)")
    given = parser.parse_args()
    print("| ramps | camera curve | projector curve | camera crosstalk | projector crosstalk | full well |")
    print("| --- | --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as room:
        for i, (name, tables) in enumerate(PHOTOMETRY.items()):
            spec = scene(given.scale, tables)
            errors = np.max(
                [
                    photometric_errors(spec, photometry(spec, Path(room) / f"{i}-{seed}", seed))
                    for seed in range(given.seeds)
                ],
                axis=0,
            )
            mixes = [f"{e:.4f}" if spec.camera.crosstalk else "–" for e in errors[2:4]]
            curves = " | ".join(f"{100.0 * e:.2f} %" for e in errors[:2])
            print(f"| {name} | {curves} | {mixes[0]} | {mixes[1]} | {100.0 * errors[4]:.1f} % |", flush=True)
        print("\n| boards | RMS camera px | RMS projector px | chi² / 22 | worst z | baseline µm |")
        print("| --- | --- | --- | --- | --- | --- |")
        device = {"distortion": LENS}
        rig = {
            "camera": {"width": 1280, "height": 1024, "focal_px": 2743.0} | device,
            "projector": {"width": 1024, "height": 768, "focal_px": 2048.0, "cy": 440.0},
        }
        for code in CODES:
            print(geometric_line(code, scene(given.scale, {"rig": rig}), Path(room) / code), flush=True)


if __name__ == "__main__":
    main()
