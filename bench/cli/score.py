"""The score table on a terminal."""

from __future__ import annotations

import math
import statistics
import sys

from rich.table import Table

from bench.cli.tables import plain_table
from bench.run.directory import Run
from bench.score.metric import Metric, shown_unit
from bench.score.metrics import HEADLINE, metric_named
from bench.summary.budget import budget_rows
from bench.summary.goals import goal_rows
from bench.summary.table import score_table

_DECIMALS = {"count": 1, "deg": 4}
"""Per unit, where they are not three."""


def terminal_table(run: Run) -> Table:
    """One row per value of the first swept parameter and variant."""
    names = run.suite.metrics or HEADLINE
    by = run.suite.divided_by
    measured = [_head(metric_named(name)) for name in names]
    heads = (*by, "variant", "cases", "failed", *measured)
    table = plain_table(heads, run.suite.title or run.suite.name, right=measured)
    previous = None
    for row in score_table(run.records, names, by=by):
        if previous not in {None, row.group}:
            table.add_section()
        heads = row.group or ("all", *[""] * (len(by) - 1))[: len(by)]
        table.add_row(
            *(heads if row.group != previous else [""] * len(by)),
            row.variant,
            str(row.cases),
            str(row.failed or ""),
            *(_text(metric_named(name), value) for name, value in row.values.items()),
        )
        previous = row.group
    return table


def goals_table(run: Run) -> Table | None:
    """One row per goal of the suite; None where it has none."""
    rows = goal_rows(run.suite, run.records)
    if not rows:
        return None
    heads = ("metric", "where", "variant", "cases", "goal", "measured", "")
    title = f"Goals: {sum(row.met for row in rows)} of {len(rows)} met"
    table = plain_table(heads, title, right={"cases", "goal", "measured"})
    for row in rows:
        metric = metric_named(row.goal.metric)
        wanted = " and ".join(
            f"{sign} {_fine(metric, bound)}"
            for sign, bound in (("≥", row.goal.at_least), ("≤", row.goal.at_most))
            if bound is not None
        )
        table.add_row(
            _titled(metric),
            row.where,
            row.variant,
            str(row.cases),
            wanted,
            _fine(metric, row.measured),
            "✓" if row.met else "✗ missed",
        )
    return table


def budget_table(run: Run) -> Table | None:
    """What each stage's own errors cost, per variant and metric; None where nobody asked."""
    rows = budget_rows(run.records)
    if not rows:
        return None
    stages = list(rows[0].cost)
    title = "Where the error comes from: how much better the truth of a stage makes each metric"
    heads = ("variant", "metric", "as it is", *stages)
    table = plain_table(heads, title, right=heads[2:])
    previous = None
    for row in rows:
        metric = metric_named(row.metric)
        values = (row.left["none"], *(row.cost.get(stage, math.nan) for stage in stages))
        name = "" if row.variant == previous else row.variant
        table.add_row(name, _titled(metric), *(_text(metric, value) for value in values))
        previous = row.variant
    return table


def times_table(run: Run) -> Table:
    """Median wall time of each stage, a row per variant; workers that share the machine slow each other."""
    variants = list(dict.fromkeys(record.variant for record in run.records))
    stages = list(dict.fromkeys(stage for record in run.records for stage in record.timings_s))
    heads = [stage.removesuffix("_s") for stage in stages]
    table = plain_table(("variant", *heads), "Median wall time per stage, ms", right=heads)
    for variant in variants:
        mine = [record.timings_s for record in run.records if record.variant == variant]
        known = [[times[stage] for times in mine if stage in times] for stage in stages]
        table.add_row(variant, *(f"{1e3 * statistics.median(ts):.0f}" if ts else "–" for ts in known))
    return table


def caption() -> str:
    """How to read the table."""
    return "mm and deg: median over cases, failures ranking last; shares and counts: mean"


def say_failures(run: Run) -> None:
    """Name the cases without a result; their tracebacks are in the records."""
    for record in run.records:
        if record.failure:
            first = record.failure.error.splitlines()[0]
            print(f"failed: {record.case}, {record.variant}: {first}", file=sys.stderr)


def _head(metric: Metric) -> str:
    return "\n".join([*metric.title.split(), shown_unit(metric.unit)])


def _titled(metric: Metric) -> str:
    return f"{metric.title} {shown_unit(metric.unit)}".strip()


def _fine(metric: Metric, value: float) -> str:
    """With as many digits as a goal may have."""
    return f"{100.0 * value:.4g}" if metric.unit == "1" else f"{value:.4g}"


def _text(metric: Metric, value: float) -> str:
    if math.isnan(value):
        return "–"
    if math.isinf(value):
        return "failed"
    if metric.unit == "1":
        return f"{100.0 * value:.1f}"
    return f"{value:.{_DECIMALS.get(metric.unit, 3)}f}"
