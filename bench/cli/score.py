"""The score table on a terminal."""

from __future__ import annotations

import math
import sys

from rich.table import Table

from bench.cli.tables import plain_table
from bench.run.directory import Run
from bench.score.metric import Metric
from bench.score.metrics import HEADLINE, metric_named
from bench.score.summary import Row, score_table


def terminal_table(run: Run) -> Table:
    """One row per value of the first swept parameter and variant."""
    names = run.suite.metrics or HEADLINE
    by = next(iter(run.suite.sweep), None)
    table = plain_table(run.suite.title or run.suite.name)
    for head in (by or "", "variant", "cases", "failed"):
        table.add_column(head, no_wrap=True)
    for name in names:
        table.add_column(_head(metric_named(name)), justify="right", no_wrap=True)
    previous = None
    for row in score_table(run.records, names, by=by):
        if previous not in {None, row.group}:
            table.add_section()
        table.add_row(
            "" if row.group == previous else row.group,
            row.variant,
            str(row.cases),
            str(row.failed or ""),
            *_values(row),
        )
        previous = row.group
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
    unit = {"1": "%", "count": ""}.get(metric.unit, metric.unit)
    return "\n".join([*metric.title.split(), unit])


def _values(row: Row) -> list[str]:
    return [_text(metric_named(name), value) for name, value in row.values.items()]


def _text(metric: Metric, value: float) -> str:
    if math.isnan(value):
        return "–"
    if math.isinf(value):
        return "failed"
    if metric.unit == "1":
        return f"{100.0 * value:.1f}"
    return f"{value:.1f}" if metric.unit == "count" else f"{value:.3f}"
