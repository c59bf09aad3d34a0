"""``burrscan report``."""

from __future__ import annotations

import argparse
from pathlib import Path

from bench.cli.grammar import Commands, add_trust, command


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
    add_trust(parser, "RUN")


def main(given: argparse.Namespace) -> int:
    """Build it and say where it is."""
    from bench.report import build_report
    from bench.run.directory import load_run
    from burrscan.variants import shipped_only

    load_run(given.run)
    with shipped_only(str(given.run), trusted=given.trust):
        page = build_report(given.run)
    print(page)
    return 0
