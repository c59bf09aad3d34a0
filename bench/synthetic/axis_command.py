"""The table of axis methods, on synthetic partial scans.

    python -m bench.synthetic axis [--methods NAME ...] [--profile NAME] [--seeds N]

Every method of ``burrscan.find_axis`` (or any "module:function") sees the same scans: arcs of 140 and 60
degrees of a stepped wheel of radius 80 to 100 mm, 122,682 triangles, noise of 0.05, 0.2 and 1.0 mm along the
normal. Beside the errors stands the Cramér-Rao bound. For times on one thread set NUMBA_NUM_THREADS=1. Five
minutes for all methods.
"""

from __future__ import annotations

import argparse
import math
from importlib.metadata import version

from rich.console import Console

from bench.synthetic.axis_table import Row, axis_table
from bench.synthetic.revolution import SHAPES
from burrscan.axis import METHODS

HEADS = ("method", "arc deg", "sigma mm", "median deg", "bound deg", "off", "95 % hold", "ms")
WIDTHS = (20, 8, 9, 11, 10, 10, 14, 8)
"""Characters of the table's columns."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """What the command takes."""
    parser.add_argument("--methods", nargs="+", default=list(METHODS), metavar="NAME")
    parser.add_argument("--profile", default="stepped_wheel", choices=SHAPES)
    parser.add_argument("--seeds", type=int, default=20)


def run(given: argparse.Namespace) -> None:
    """Print the table, row by row."""
    print_line = Console(soft_wrap=True, highlight=False).print
    print_line(f"burrscan {version('burrscan')}, numpy {version('numpy')}, {given.profile}")
    print_line(_line(HEADS))
    for row in axis_table(given.methods, profile=given.profile, seeds=given.seeds):
        print_line(_line(cells(row)))


def cells(row: Row) -> tuple[str, ...]:
    """A row as it is printed."""
    held = (
        "–" if math.isnan(row.coverage) else f"{100 * row.coverage:.1f} ± {100 * row.coverage_within:.1f} %"
    )
    return (
        row.method,
        f"{row.arc_deg:g}",
        f"{row.sigma_mm:g}",
        f"{row.median_deg:.4f}",
        f"{row.bound_deg:.4f}",
        f"{row.off} of {row.runs}",
        held,
        f"{1e3 * row.seconds:.0f}",
    )


def _line(texts: tuple[str, ...]) -> str:
    first, *rest = (text.rjust(width) for text, width in zip(texts, WIDTHS, strict=True))
    return "".join([first.strip().ljust(WIDTHS[0]), *rest])
