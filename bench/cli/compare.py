"""``burrscan compare``."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.cli.grammar import add_json, add_trust
from bench.cli.output import told, write_json

if TYPE_CHECKING:
    from bench.compare.outputs import Sitting

SUMMARY = "say what got better or worse between two runs, or two variants of one"
DETAILS = """\
Cases are paired: both arms saw the same scene and the same light. Every row answers two questions.
What happened on these cases: how many got worse or better by more than the margin, and which burrs
were lost and gained. What it means for others: an interval, which is an exact paired test over
scenes turned round, Holm's correction for all gated metrics included, judged against a margin, the
difference that is too small to matter:
  equivalent      the interval lies within the margin
  worse, better   it does not, and zero is outside it
  inconclusive    more scenes would tell
  not comparable  another scene, or another version of the metric
BASE may be a folder of accepted runs (see `burrscan accept`); the newest one is taken. Of three or
more runs each is compared with the first, and judged as if it were compared alone; every file holds
all of them.

exit codes: 0 no gate is broken, 1 a gate is broken (--strict: or inconclusive), 2 not comparable or
bad input"""

EXAMPLES = """\
  burrscan compare reports/runs/before reports/runs/after
  burrscan compare reports/runs/quick-20260801T120000 --variants fixed adaptive
  burrscan compare reports/baselines/quick reports/runs/after --html ab.html --markdown pr.md
  burrscan compare before after --margin axis_deg=0.02 --margin coverage=0.005"""


def options(parser: argparse.ArgumentParser) -> None:
    """What it takes."""
    parser.add_argument("base", metavar="BASE", type=Path, help="a run directory")
    parser.add_argument(
        "new", metavar="NEW", type=Path, nargs="*", help="others; without one, --variants A B"
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
    parser.add_argument("--strict", action="store_true", help="exit 1 when a gate is inconclusive, too")
    parser.add_argument("--only", choices=("worse", "better"), help="print only rows and cases that went so")
    add_trust(parser, "a run", of=["base", "new"])
    add_json(parser, "everything")
    for name, what in _WRITES.items():
        parser.add_argument(f"--{name}", metavar="FILE", type=Path, help=f"write {what}")


_WRITES = {
    "html": "it as a report with curves, heat maps and the cases that changed",
    "markdown": "it as Markdown",
    "junit": "the gates as JUnit XML",
    "csv": "a line per metric as CSV",
    "latex": "a LaTeX table per variant",
}


def main(given: argparse.Namespace) -> int:
    """Compare, print, write; the exit code is the verdict."""
    from bench.baselines import newest
    from bench.compare import compare_runs, joined
    from bench.compare.outputs import Sitting, to_document
    from bench.run.directory import load_run
    from burrscan.errors import InputError

    if not given.new and given.variants is None:
        raise InputError("compare with what? Name a second run, or two variants: --variants A B")
    start = time.monotonic()
    base = load_run(newest(given.base))
    variants = (given.variants[0], given.variants[1]) if given.variants else None
    runs = [load_run(newest(path)) for path in given.new] or [base]
    margins = dict(given.margin)
    comparisons = [compare_runs(base, new, variants=variants, margins=margins) for new in runs]
    sitting = Sitting.ended(time.monotonic() - start)
    with told(given.json):
        for comparison in comparisons:
            _print(comparison, only=given.only)
        _write(given, joined(comparisons), sitting)
        if given.html:
            from bench.report import build_comparison

            pairs = list(zip(runs, comparisons, strict=True))
            print(f"report: {build_comparison(base, pairs, given.html)}")
    if given.json:
        write_json(given.json, to_document(joined(comparisons)))
    codes = [one.strict_exit_code() if given.strict else one.exit_code for one in comparisons]
    return 1 if 1 in codes else max(codes)


def _margin(text: str) -> tuple[str, float]:
    name, _equals, value = text.partition("=")
    try:
        return name.strip(), float(value)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not METRIC=VALUE, such as axis_deg=0.02") from None


def _print(comparison: Any, *, only: str | None) -> None:
    from bench.cli.tables import print_table
    from bench.compare.outputs import GATE_SIGNS, LEGEND
    from bench.compare.text import remarks

    for arm in comparison.arms:
        print_table(_table(arm, only))
        if only:
            print("\n".join(_changed(arm, only)) + "\n")
            continue
        print("\n".join(f"gate {GATE_SIGNS[gate.state]} {gate.said}" for gate in arm.gates))
        print("\n".join(remarks(arm)) + "\n")
    for key, (base, new) in comparison.provenance.items():
        print(f"differs: {key}: {base} -> {new}")
    print(f"{LEGEND}\n\n{comparison.sentence()}")


def _changed(arm: Any, only: str) -> list[str]:
    """The cases that went one way by more than a margin, most first, and the burrs that did."""
    burrs = arm.burrs.lost if only == "worse" else arm.burrs.gained
    lines = [f"{'lost' if only == 'worse' else 'gained'}: {change}" for change in burrs]
    found = [
        (change.worst, change.worst_metric, change.case)
        if only == "worse"
        else (change.best, change.best_metric, change.case)
        for change in arm.cases
    ]
    found = sorted((item for item in found if item[0] > 1.0), key=lambda item: -item[0])
    return lines + [f"{case}: {metric} {only} by {margins:.1f} margins" for margins, metric, case in found]


_STYLES: dict[str, str] = {"worse": "bold red", "better": "bold green", "not comparable": "yellow"}


def _table(arm: Any, only: str | None) -> Any:
    from bench.cli.tables import plain_table
    from bench.compare.text import HEADS, cells

    table = plain_table(HEADS, f"{arm.base} → {arm.new}", right=HEADS[1:-1])
    for row in arm.rows:
        if only and only not in {row.verdict, row.seen, row.every}:
            continue
        table.add_row(*cells(row), style=_STYLES.get(row.verdict, "" if row.gated else "dim"))
    return table


def _write(given: argparse.Namespace, comparison: Any, sitting: Sitting) -> None:
    from bench.compare.outputs import junit, latex, markdown, to_csv
    from burrscan.files import write_text

    writers: dict[str, Callable[[Any], str]] = {
        "markdown": markdown,
        "junit": lambda one: junit(one, sitting),
        "csv": to_csv,
        "latex": latex,
    }
    for name, write in writers.items():
        if path := getattr(given, name):
            write_text(path, write(comparison))
