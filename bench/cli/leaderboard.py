"""``burrscan leaderboard``."""

from __future__ import annotations

import argparse
from pathlib import Path

from bench.cli.grammar import add_trust

_START, _END = "<!-- leaderboard -->", "<!-- end of the leaderboard -->"

SUMMARY = "the variants of a run, best first, as a Markdown table"
DETAILS = f"""\
One row per variant, the best of each column in bold, the variants with the least mean rank first.
Errors are medians, shares and counts means. a50 and a90 are burr heights that are found with a
probability of 0.5 and 0.9, a90/95 the upper 95 % confidence bound of a90. With --into the table
replaces what stands between the lines {_START}
and {_END} of a file."""

EXAMPLES = "  burrscan leaderboard reports/runs/standard-20260801T120000 --into reports/README.md"


def options(parser: argparse.ArgumentParser) -> None:
    """What it takes."""
    parser.add_argument("run", metavar="RUN", type=Path, help="a run directory")
    parser.add_argument("--into", metavar="FILE", type=Path, help="a Markdown file with the two lines")
    add_trust(parser, "RUN", of=["run"])


def main(given: argparse.Namespace) -> int:
    """Print the table, or put it into a file."""
    from bench.leaderboard import leaderboard
    from bench.run.directory import load_run

    table = leaderboard(load_run(given.run))
    if given.into:
        _put(given.into, table)
    else:
        print(table, end="")
    return 0


def _put(path: Path, table: str) -> None:
    """Replace what stands between the two lines."""
    from burrscan.errors import InputError
    from burrscan.files import write_text

    text = path.read_text("utf-8") if path.exists() else ""
    before, start, rest = text.partition(_START)
    _, end, after = rest.partition(_END)
    if not (start and end):
        raise InputError(f"{path}: has no lines '{_START}' and '{_END}' to put the table between")
    write_text(path, f"{before}{start}\n\n{table}\n{end}{after}")
