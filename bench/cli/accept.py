"""``burrscan accept``."""

from __future__ import annotations

import argparse
from pathlib import Path

from bench.cli.grammar import add_baselines

SUMMARY = "make a run the baseline that later runs are compared with"
DETAILS = "A small copy, without pictures, goes to reports/baselines/SUITE/; commit it."
EXAMPLES = "  burrscan accept reports/runs/quick-20260801T120000 --note 'finer stripes'"


def options(parser: argparse.ArgumentParser) -> None:
    """What it takes."""
    parser.add_argument("run", metavar="RUN", type=Path, help="a finished run's directory")
    parser.add_argument("--note", metavar="TEXT", default="", help="why, for the history")
    add_baselines(parser)


def main(given: argparse.Namespace) -> int:
    """Copy it, and say what was accepted."""
    from bench.baselines import accept
    from bench.run.directory import load_run
    from bench.run.records import count_failed

    run = load_run(given.run)
    path = accept(run, baselines=given.baselines, note=given.note)
    failed = count_failed(run.records)
    print(f"accepted: {path} ({len(run.records)} records, {failed} of them without a result)")
    print(f"to keep it: git add {path}")
    return 0
