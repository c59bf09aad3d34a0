"""``burrscan calibrate``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from bench.cli.grammar import add_json, corners, raster, side_mm
from bench.cli.output import json_beside, note, told

SUMMARY = "calibrate camera and projector (boards, ramps), or a camera on a robot (--hand-eye)"
DETAILS = """\
Geometry: each FOLDER shows a flat chessboard in another pose. It is a capture folder that codes columns
and rows (strategy 'both', with any code), or a plain Gray-code folder (columns, rows, white, black). Tilt
the board by 20 to 45 degrees, in all directions, over the whole field; ten poses are enough. The side of
a square sets the scale: measure it over many squares. Uncertainties come from the residuals; the board's
own errors are not in them.

Photometry: one FOLDER with ramps of an evenly lit white board (ramps.json). Both response curves, both
crosstalk matrices, full well and read noise go to a sheets.json for `burrscan scan --sheets`.

Hand-eye (--hand-eye): where the camera sits on a robot's flange. Each FOLDER holds pictures of one board
that stands still, and poses.json or poses.csv: where the robot said its flange was for each. Turn the
flange by 20 degrees and more about two axes at least, the board whole in sight; ten poses are good. The
camera's lens is taken from --rig.

All formats: burrscan/captures/README.md."""

EXAMPLES = """\
  burrscan calibrate boards/* --board 10x7 --square 20 --out rig.json
  burrscan calibrate boards/* --board 10x7 --square 20 --gray 1024x768 --out rig.json
  burrscan calibrate ramps --out sheets.json
  burrscan calibrate arm --hand-eye --rig rig.json --board 10x7 --square 20 --out hand_eye.json"""


def options(parser: argparse.ArgumentParser) -> None:
    """What it takes."""
    parser.add_argument(
        "folders",
        metavar="FOLDER",
        type=Path,
        nargs="+",
        help="captures of a board, ramps, or an arm's pictures",
    )
    parser.add_argument("--board", metavar="CxR", type=corners, help="inner corners, as 10x7")
    parser.add_argument("--square", metavar="MM", type=side_mm, help="side of a square")
    parser.add_argument("--gray", metavar="WxH", type=raster, help="plain Gray code; the projector's raster")
    parser.add_argument(
        "--out", metavar="FILE", type=Path, required=True, help="the rig, sheets or hand_eye.json to write"
    )
    add_json(parser, "values and uncertainties")
    parser.add_argument(
        "--distortion",
        metavar="N",
        type=int,
        help="coefficients sought: 0, 2, 4 or 5 (default: 4, or fewer where the boards leave them open)",
    )

    parser.add_argument("--hand-eye", action="store_true", help="find the camera on a robot's flange")
    parser.add_argument(
        "--rig", metavar="FILE", type=Path, help="with --hand-eye: the rig.json of the camera"
    )


def main(given: argparse.Namespace) -> int:
    """Calibrate, print, and write what was found."""
    from burrscan.captures.ramps import is_ramp_folder

    if given.hand_eye:
        from bench.cli.hand_eye import hand_eye

        return hand_eye(given)
    ramps = [folder for folder in given.folders if is_ramp_folder(folder)]
    return _photometry(given) if ramps else _geometry(given)


def _geometry(given: argparse.Namespace) -> int:
    from burrscan.calibration.board import Board
    from burrscan.calibration.geometric import calibrate_captures
    from burrscan.captures.folder import write_rig
    from burrscan.errors import InputError

    if given.board is None or given.square is None:
        raise InputError(
            "captures of a board need its inner corners and its squares: --board 10x7 --square 20"
        )
    board = Board(given.board[0], given.board[1], given.square)
    captures, camera, projector = _captures(given.folders, given.gray)
    found, left_out = calibrate_captures(
        captures, board, camera=camera, projector=projector, distortion=given.distortion
    )
    for why in left_out:
        note(f"note: left out: {why}")
    with told(given.json):
        _print(found)
    with json_beside(given.json, _geometry_tables(found)):
        write_rig(given.out, found.rig)
    return 0


def _captures(
    folders: list[Path], gray: tuple[int, int] | None
) -> tuple[list[Any], tuple[int, int], tuple[int, int]]:
    """Names, white pictures and correspondences; and the sizes of camera and projector."""
    from burrscan.captures.board_folder import read_board_folder
    from burrscan.errors import InputError

    seen = [read_board_folder(folder, gray=gray) for folder in folders]
    camera, projector = seen[0].camera, seen[0].projector
    for folder, one in zip(folders, seen, strict=True):
        if (one.camera, one.projector) != (camera, projector):
            raise InputError(
                f"{folder}: its pictures or patterns have another size than those of {folders[0]}"
            )
    captures = [(str(f), one.white, one.correspondence) for f, one in zip(folders, seen, strict=True)]
    return captures, camera, projector


def _print(found: Any) -> None:
    print("RMS px       camera  projector  corners")
    for name, rms, seen in zip(found.views, found.rms_px, found.corners, strict=True):
        print(f"{rms[0]:19.3f}{rms[1]:11.3f}{seen:9d}  {name}")
    camera, projector = found.sigma_px
    print(f"\ncorners known to {camera:.3f} px and {projector:.3f} px; {found.refused} set aside\n")
    for name, value, sigma in zip(found.names, found.values, found.sigma, strict=True):
        print(f"{name:<18}{value:>14.5f} ± {sigma:.5f}")


def _geometry_tables(found: Any) -> dict[str, Any]:
    return {
        "values": dict(zip(found.names, found.values.tolist(), strict=True)),
        "sigma": dict(zip(found.names, found.sigma.tolist(), strict=True)),
        "covariance": found.covariance.tolist(),
        "views": list(found.views),
        "rms_px": found.rms_px.tolist(),
        "corners": list(found.corners),
        "sigma_px": list(found.sigma_px),
        "refused": found.refused,
    }


def _photometry(given: argparse.Namespace) -> int:
    from burrscan.calibration.photometric import calibrate_photometry
    from burrscan.captures.ramps import read_ramps
    from burrscan.captures.sheets import write_sheets
    from burrscan.errors import InputError

    if len(given.folders) != 1:
        raise InputError(
            f"{len(given.folders)} folders: ramps are calibrated one folder at a time, no boards beside"
        )
    capture = read_ramps(given.folders[0])
    found = calibrate_photometry(capture.lamps, capture.levels, bit_depth=capture.bit_depth)
    camera = found.camera_sheet(exposure_range_ms=capture.exposure_range_ms)
    with told(given.json):
        _print_photometry(found, camera)
    with json_beside(given.json, _photometry_tables(found)):
        write_sheets(given.out, camera, found.projector_sheet())
    return 0


def _print_photometry(found: Any, camera: Any) -> None:
    print(f"camera            full well {camera.full_well_e:.0f} e, read noise {camera.read_noise_e:.2f} e")
    for channel, curve in enumerate(found.camera):
        low, high = curve.measured_dn
        print(
            f"camera curve {channel}    black {curve.black_dn:.2f} DN, measured {low:.0f} to {high:.0f} DN, "
            f"± {100.0 * curve.sigma.max():.3f} % of full scale"
        )
    for primary, sheet in enumerate(found.projector.sheets):
        sigma = found.projector.sigma[primary].max()
        print(
            f"projector curve {primary} black 1/{1.0 / max(sheet.light[0], 1e-9):.0f}, "
            f"± {100.0 * sigma:.3f} % of full scale"
        )
    if len(found.camera_mix) > 1:
        _print_mix("camera crosstalk", found.camera_mix, found.camera_mix_sigma)
        _print_mix("projector crosstalk", found.projector_mix, found.projector_mix_sigma)


def _print_mix(name: str, mix: Any, sigma: Any) -> None:
    print(name)
    for row, around in zip(mix, sigma, strict=True):
        print("".join(f"{value:10.4f} ± {s:.4f}" for value, s in zip(row, around, strict=True)))


def _photometry_tables(found: Any) -> dict[str, Any]:
    return {
        "full_well_e": found.full_well_e,
        "read_noise_e": found.read_noise_e,
        "camera": [{"light": c.light.tolist(), "sigma": c.sigma.tolist()} for c in found.camera],
        "projector": [
            {"light": sheet.light.tolist(), "sigma": sigma.tolist()}
            for sheet, sigma in zip(found.projector.sheets, found.projector.sigma, strict=True)
        ],
        "camera_crosstalk": found.camera_mix.tolist(),
        "camera_crosstalk_sigma": found.camera_mix_sigma.tolist(),
        "projector_crosstalk": found.projector_mix.tolist(),
        "projector_crosstalk_sigma": found.projector_mix_sigma.tolist(),
    }
