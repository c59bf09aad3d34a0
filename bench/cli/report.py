"""``burrscan report``."""

from __future__ import annotations

import argparse
from pathlib import Path

from bench.cli.grammar import Commands, command


def add(commands: Commands) -> None:
    """Declare the subcommand."""
    parser = command(
        commands,
        "report",
        main,
        summary="build a run's HTML report anew",
        details="An unfinished run gets a report of what there is.",
        examples="  burrscan report reports/runs/quick-20260801T120000",
    )
    parser.add_argument("run", metavar="RUN", type=Path, help="a run directory")


def main(given: argparse.Namespace) -> int:
    """Build it and say where it is."""
    from bench.report import build_report
    from bench.run.directory import load_run

    load_run(given.run)
    print(build_report(given.run))
    return 0
