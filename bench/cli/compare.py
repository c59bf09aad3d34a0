"""``burrscan compare``."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bench.cli.grammar import Commands, command

_DETAILS = """\
Cases are paired: both arms saw the same scene and the same light. A difference is judged by its
95 % interval (scenes resampled) and p-value (Holm over all gated metrics) against a margin, the
difference that is too small to matter:
  equivalent      the interval lies within the margin
  worse, better   it does not, and the difference is no chance
  inconclusive    more scenes would tell
  not comparable  another scene, or another version of the metric
BASE may be a folder of accepted runs (see `burrscan accept`); the newest one is taken.

exit codes: 0 nothing is worse, 1 a gated metric is worse, 2 not comparable or bad input"""

_EXAMPLES = """\
  burrscan compare reports/runs/before reports/runs/after
  burrscan compare reports/runs/quick-20260801T120000 --variants fixed adaptive
  burrscan compare reports/baselines/quick reports/runs/after --html ab.html --markdown pr.md
  burrscan compare before after --margin axis_deg=0.02 --margin coverage=0.005"""


def add(commands: Commands) -> None:
    """Declare the subcommand."""
    parser = command(
        commands,
        "compare",
        main,
        summary="say what got better or worse between two runs, or two variants of one",
        details=_DETAILS,
        examples=_EXAMPLES,
    )
    parser.add_argument("base", metavar="BASE", type=Path, help="a run directory")
    parser.add_argument(
        "new", metavar="NEW", type=Path, nargs="?", help="another; without it, --variants A B"
    )
    parser.add_argument("--variants", metavar=("A", "B"), nargs=2, help="variant A of BASE against B of NEW")
    parser.add_argument(
        "--margin",
        metavar="METRIC=VALUE",
        type=_margin,
        action="append",
        default=[],
        help="equivalence margin in the metric's unit, shares as fractions; may be repeated",
    )
    for name, what in _WRITES.items():
        parser.add_argument(f"--{name}", metavar="FILE", type=Path, help=f"write {what}")


_WRITES = {
    "html": "it as a report with curves, heat maps and the cases that changed",
    "markdown": "it as Markdown",
    "junit": "the gates as JUnit XML",
    "json": "everything as JSON",
}


def main(given: argparse.Namespace) -> int:
    """Compare, print, write; the exit code is the verdict."""
    from bench.baselines import newest
    from bench.compare import compare_runs
    from bench.run.directory import load_run
    from burrscan.errors import InputError

    if given.new is None and given.variants is None:
        raise InputError("compare with what? Name a second run, or two variants: --variants A B")
    base = load_run(newest(given.base))
    new = load_run(newest(given.new)) if given.new else base
    variants = (given.variants[0], given.variants[1]) if given.variants else None
    comparison = compare_runs(base, new, variants=variants, margins=dict(given.margin))
    _print(comparison)
    _write(given, comparison)
    if given.html:
        from bench.report import build_comparison

        print(f"report: {build_comparison(base, new, comparison, given.html)}")
    return comparison.exit_code


def _margin(text: str) -> tuple[str, float]:
    name, _equals, value = text.partition("=")
    try:
        return name.strip(), float(value)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not METRIC=VALUE, such as axis_deg=0.02") from None


def _print(comparison: Any) -> None:
    from bench.cli.tables import print_table
    from bench.compare.outputs import LEGEND
    from bench.compare.text import remarks

    for arm in comparison.arms:
        print_table(_table(arm))
        print("\n".join(remarks(arm)) + "\n")
    for key, (base, new) in comparison.provenance.items():
        print(f"differs: {key}: {base} -> {new}")
    print(f"{LEGEND}\n\n{comparison.sentence()}")


_STYLES: dict[str, str] = {"worse": "bold red", "better": "bold green", "not comparable": "yellow"}


def _table(arm: Any) -> Any:
    from bench.cli.tables import plain_table
    from bench.compare.text import HEADS, cells

    table = plain_table(f"{arm.base} → {arm.new}")
    for head in HEADS:
        table.add_column(head, justify="left" if head in {"metric", "verdict"} else "right", no_wrap=True)
    for row in arm.rows:
        table.add_row(*cells(row), style=_STYLES.get(row.verdict, "" if row.gated else "dim"))
    return table


def _write(given: argparse.Namespace, comparison: Any) -> None:
    from bench.compare.outputs import junit, markdown, to_json
    from burrscan.files import written_whole

    writers: dict[str, Callable[[Any], str]] = {"markdown": markdown, "junit": junit, "json": to_json}
    for name, write in writers.items():
        if path := getattr(given, name):
            with written_whole(path) as beside:
                beside.write_text(write(comparison), "utf-8")
