"""``burrscan paper``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

SUMMARY = "the seed paper claim by claim, on one page"
DETAILS = (
    "Renders scans of a wheel like the paper's, repeats each of its figures, tables and "
    "numbers\nwith its own method and with the default, and says which claims hold. What was measured "
    "is kept\nbeside the page, so that an interrupted run goes on where it was. All of it takes about "
    "46 minutes\nof one core."
)
EXAMPLES = (
    "  burrscan paper\n  burrscan paper --only figure-10 --out landscape.html\n  burrscan "
    "paper --quick --out quick.html"
)


def options(parser: argparse.ArgumentParser) -> None:
    """What it takes."""
    parser.add_argument(
        "--out", metavar="FILE", type=Path, default=Path("reports/paper.html"), help="the page"
    )
    parser.add_argument("--only", metavar="SECTION", action="append", default=[], help="such as figure-10")
    parser.add_argument("--quick", action="store_true", help="small and few: shows that everything works")


def main(given: argparse.Namespace) -> int:
    """Measure, draw, and say where the page is."""
    from bench.reproduction import build_paper
    from bench.reproduction.lab import Lab

    lab = Lab(given.out.with_suffix("") / "work", quick=given.quick)
    tell = lambda name: print(f"paper: {name}", file=sys.stderr, flush=True)  # noqa: E731
    print(build_paper(lab, given.out, only=given.only, tell=tell))
    return 0
