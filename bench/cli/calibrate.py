"""``burrscan calibrate``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from bench.cli.grammar import Commands, command, raster

_DETAILS = """\
Each FOLDER shows a flat chessboard in another pose: a plain Gray-code folder (columns, rows, white,
black; burrscan/captures/README.md). Tilt the board by 20 to 45 degrees, in all directions, over the
whole field; ten poses are enough. The side of a square sets the scale: measure it over many squares.
Uncertainties come from the residuals; the board's own errors are not in them."""

_EXAMPLES = """\
  burrscan calibrate boards/* --board 10x7 --square 20 --gray 1024x768 --out rig.json"""


def add(commands: Commands) -> None:
    """Declare the subcommand."""
    parser = command(
        commands,
        "calibrate",
        main,
        summary="calibrate camera and projector from captures of a chessboard",
        details=_DETAILS,
        examples=_EXAMPLES,
    )
    parser.add_argument("folders", metavar="FOLDER", type=Path, nargs="+", help="a capture of the board")
    parser.add_argument("--board", metavar="CxR", type=raster, required=True, help="inner corners, as 10x7")
    parser.add_argument("--square", metavar="MM", type=float, required=True, help="side of a square")
    parser.add_argument("--gray", metavar="WxH", type=raster, required=True, help="the projector's raster")
    parser.add_argument("--out", metavar="FILE", type=Path, required=True, help="the rig.json to write")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write values and uncertainties as JSON")
    parser.add_argument(
        "--distortion", metavar="N", type=int, default=4, help="coefficients sought: 0, 2, 4 (default) or 5"
    )


def main(given: argparse.Namespace) -> int:
    """Calibrate, print, and write the rig."""
    from burrscan.calibration.board import Board
    from burrscan.calibration.geometric import calibrate
    from burrscan.captures.folder import write_rig
    from burrscan.errors import InputError

    if not given.square > 0.0:
        raise InputError(f"--square {given.square:g}: the side of a square is above zero")
    board = Board(given.board[0], given.board[1], given.square)
    views, shape = _views(given.folders, board, given.gray)
    found = calibrate(
        views, board, camera=(shape[1], shape[0]), projector=given.gray, distortion=given.distortion
    )
    _print(found)
    write_rig(given.out, found.rig)
    if given.json:
        _write_json(given.json, found)
    return 0


def _views(folders: list[Path], board: Any, projector: tuple[int, int]) -> tuple[list[Any], tuple[int, ...]]:
    from burrscan.calibration.board import board_view
    from burrscan.captures.gray_folder import decode_gray_capture, read_gray_folder
    from burrscan.errors import InputError

    views: list[Any] = []
    shape: tuple[int, ...] = ()
    for folder in folders:
        capture = read_gray_folder(folder, width=projector[0], height=projector[1])
        if shape and capture.white.shape != shape:
            raise InputError(f"{folder}: its pictures have another size than those of {folders[0]}")
        shape = capture.white.shape
        try:
            views.append(board_view(str(folder), capture.white, decode_gray_capture(capture), board))
        except InputError as error:  # one bad view among many is no reason to stop
            print(f"note: left out: {error}", file=sys.stderr)
    return views, shape


def _print(found: Any) -> None:
    print("RMS px       camera  projector  corners")
    for name, rms, corners in zip(found.views, found.rms_px, found.corners, strict=True):
        print(f"{rms[0]:19.3f}{rms[1]:11.3f}{corners:9d}  {name}")
    camera, projector = found.sigma_px
    print(f"\ncorners known to {camera:.3f} px and {projector:.3f} px; {found.refused} set aside\n")
    for name, value, sigma in zip(found.names, found.values, found.sigma, strict=True):
        print(f"{name:<18}{value:>14.5f} ± {sigma:.5f}")


def _write_json(path: Path, found: Any) -> None:
    import json

    from burrscan.files import written_whole

    document = {
        "values": dict(zip(found.names, found.values.tolist(), strict=True)),
        "sigma": dict(zip(found.names, found.sigma.tolist(), strict=True)),
        "covariance": found.covariance.tolist(),
        "views": list(found.views),
        "rms_px": found.rms_px.tolist(),
        "corners": list(found.corners),
        "sigma_px": list(found.sigma_px),
        "refused": found.refused,
    }
    with written_whole(path) as beside:
        beside.write_text(json.dumps(document, indent=1) + "\n", "utf-8")
