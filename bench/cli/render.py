"""``burrscan render``."""

from __future__ import annotations

import argparse
from pathlib import Path

from bench.cli.grammar import corners, not_negative, positive, side_mm

SUMMARY = "render a scene to a capture folder, as if a scanner had recorded it"
DETAILS = """\
Pattern and camera images (PNG), rig (JSON), scene, and the truth in a file of its own.

With --ramps: an evenly lit white board in front of the scene's camera and projector, under lamps at many
exposures and under the projector at many levels, in colour where the scene has crosstalk.
With --boards N: a chessboard in N poses, each a capture folder that codes columns and rows.
`burrscan calibrate` takes both."""

EXAMPLES = """\
  burrscan render paper --out captures/paper
  burrscan render paper --ramps --out captures/ramps
  burrscan render paper --boards 10 --board 10x7 --square 20 --out captures/boards
  burrscan render paper --sheets sheets.json --out captures/paper   # the scanner is told measured sheets"""


def options(parser: argparse.ArgumentParser) -> None:
    """What it takes."""
    parser.add_argument("scene", metavar="SCENE", help="a scene's name, or the path of a TOML file")
    parser.add_argument("--out", metavar="DIR", type=Path, required=True, help="the folder to write")
    parser.add_argument("--scan", metavar="METHOD", help="strategy (default: adaptive, or colour)")
    parser.add_argument("--seed", metavar="S", type=not_negative, default=0, help="of the noise (default: 0)")
    parser.add_argument("--sheets", metavar="FILE", type=Path, help="what the scanner is told of its devices")
    instead = parser.add_mutually_exclusive_group()
    instead.add_argument("--ramps", action="store_true", help="ramps for the photometric calibration")
    instead.add_argument("--boards", metavar="N", type=positive, help="N captures of a calibration board")
    parser.add_argument(
        "--board", metavar="CxR", type=corners, default=(10, 7), help="its inner corners (default: 10x7)"
    )
    parser.add_argument(
        "--square", metavar="MM", type=side_mm, default=20.0, help="side of its squares (default: 20)"
    )
    parser.add_argument(
        "--code", metavar="CODE", default="gray_phase", help="for boards (default: gray_phase)"
    )


def main(given: argparse.Namespace) -> int:
    """Render and write."""
    from burrscan.calibration.board import Board
    from burrscan.captures.sheets import read_sheets
    from scenes.board import write_coded_boards
    from scenes.capture_folder import write_capture, written_folder
    from scenes.ramp_folder import write_ramps
    from scenes.scene import load_scene

    scene = load_scene(given.scene)
    if given.ramps:
        with written_folder(given.out) as folder:
            write_ramps(scene, folder, seed=given.seed)
    elif given.boards:
        board = Board(given.board[0], given.board[1], given.square)
        with written_folder(given.out) as folder:
            write_coded_boards(
                scene, folder, board=board, count=given.boards, code=given.code, seed=given.seed
            )
    else:
        sheets = read_sheets(given.sheets) if given.sheets else None
        write_capture(scene, given.out, seed=given.seed, scan=given.scan, sheets=sheets)
    print(given.out)
    return 0
