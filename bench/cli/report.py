"""``burrscan report``."""

from __future__ import annotations

import argparse
from pathlib import Path

from bench.cli.grammar import add_trust

SUMMARY = "build a run's HTML report anew"
DETAILS = "An unfinished run gets a report of what there is."
EXAMPLES = "  burrscan report reports/runs/quick-20260801T120000"


def options(parser: argparse.ArgumentParser) -> None:
    """What it takes."""
    parser.add_argument("run", metavar="RUN", type=Path, help="a run directory")
    add_trust(parser, "RUN", of=["run"])


def main(given: argparse.Namespace) -> int:
    """Build it and say where it is."""
    from bench.report import build_report

    print(build_report(given.run))
    return 0
