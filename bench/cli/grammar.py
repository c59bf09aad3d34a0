"""How every subcommand is declared."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

Commands = Any
"""What ``add_subparsers`` returns; argparse keeps its type private."""


def command(
    commands: Commands,
    name: str,
    main: Callable[[argparse.Namespace], int],
    *,
    summary: str,
    details: str = "",
    examples: str = "",
) -> argparse.ArgumentParser:
    """Declare a subcommand: one line for the overview, more for its own help."""
    parser: argparse.ArgumentParser = commands.add_parser(
        name,
        help=summary,
        description=f"{summary[0].upper()}{summary[1:]}.{chr(10) * 2 + details if details else ''}",
        epilog=f"examples:\n{examples}" if examples else None,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(main=main)
    return parser


def positive(text: str) -> int:
    """A whole number above zero."""
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"{text} is not above zero")
    return number


def length_mm(text: str) -> float:
    """A finite length of zero or more."""
    length = float(text)
    if not (math.isfinite(length) and length >= 0.0):
        raise argparse.ArgumentTypeError(f"{text} is no length in mm")
    return length


def add_inspection_options(parser: argparse.ArgumentParser) -> None:
    """The options of everything that inspects a surface."""
    parser.add_argument("--axis", metavar="METHOD", default="profile", help="a short name or module:function")
    parser.add_argument(
        "--limit", metavar="MM", type=length_mm, help="height up to which a burr is permitted"
    )
    parser.add_argument("--json", metavar="FILE", type=Path, help="write everything found as JSON")
    parser.add_argument("--ply", metavar="FILE", type=Path, help="write the mesh with its deviations as PLY")


def raster(text: str) -> tuple[int, int]:
    """A size such as ``1024x768``: width, then height."""
    width, cross, height = text.lower().replace("×", "x").partition("x")
    if not cross:
        raise argparse.ArgumentTypeError(f"{text} is no size such as 1024x768")
    return positive(width), positive(height)
