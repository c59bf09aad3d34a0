"""``burrscan gather``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from bench.cli.grammar import add_trust

SUMMARY = "put the shards of a run together"
DETAILS = """\
Every RUN is what `burrscan run SUITE --shard I/N` made, whole or in part. What comes out is a run as one
machine makes it, with its report; the parts stay as they are. When records are missing, the same
parts can be gathered again once they are there, or `burrscan run --resume --out DIR` makes them."""

EXAMPLES = """\
  burrscan gather runs/part-* --out runs/whole"""


def options(parser: argparse.ArgumentParser) -> None:
    """What it takes."""
    parser.add_argument("runs", metavar="RUN", type=Path, nargs="+", help="a run directory")
    parser.add_argument("--out", metavar="DIR", type=Path, required=True, help="a new run directory")
    add_trust(parser, "the runs", of=["runs"])


def main(given: argparse.Namespace) -> int:
    """Gather, say what is missing, build the report."""
    from bench.cli.score import caption, say_failures, terminal_table
    from bench.cli.tables import print_table
    from bench.report import build_report
    from bench.run.gather import gather, undone_on_failure

    with undone_on_failure(given.out):
        run = gather(given.runs, given.out)
        page = build_report(given.out) if run.records else None
    if run.records:
        print_table(terminal_table(run))
        print(caption())
        say_failures(run)
    if run.missing:
        again = f"burrscan run --resume --out {given.out}"
        print(f"burrscan: {run.missing} records are missing; to make them here: {again}", file=sys.stderr)
    if page:
        print(f"report: {page}")
    return 0
