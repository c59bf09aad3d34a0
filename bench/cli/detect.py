"""``burrscan detect``."""

from __future__ import annotations

import argparse
from pathlib import Path

from bench.cli.grammar import Commands, command


def add(commands: Commands) -> None:
    """Declare the subcommand."""
    parser = command(
        commands,
        "detect",
        main,
        summary="find the axis, the generatrix and the burrs of a mesh you have",
        examples="  burrscan detect wheel.stl\n  burrscan detect scan.ply --unit m --json found.json",
    )
    parser.add_argument("mesh", metavar="MESH", type=Path, help="a PLY, STL or OBJ file")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write everything found as JSON")


def main(given: argparse.Namespace) -> int:
    """Inspect the mesh and print what was found."""
    raise NotImplementedError(given)
