"""A suite's goals as a table: what was asked for, what was measured, met or missed."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from bench.report.forest import headed, shown
from bench.run import Run
from bench.score.metric import Metric, within
from bench.score.metrics import metric_named
from bench.summary.goals import GoalRow, goal_rows


@dataclass(frozen=True)
class GoalCell:
    """What one run measured for a goal: a sign, a class for its colour, the figure, and of how many cases."""

    sign: str
    css: str
    measured: str
    cases: int


@dataclass(frozen=True)
class GoalLine:
    """A goal, and what each run made of it."""

    title: str
    unit: str
    where: str
    variant: str
    wanted: str
    cells: tuple[GoalCell, ...]


@dataclass(frozen=True)
class Goals:
    """All goals of a suite; ``met``, ``open`` (no case was run), ``missed`` (in words): of the last run."""

    heads: tuple[str, ...]
    lines: tuple[GoalLine, ...]
    met: int
    open: int
    missed: str


def goals(runs: Sequence[tuple[str, Run]]) -> Goals | None:
    """The goals of the last run's suite, measured in every run; None where it has none."""
    suite = runs[-1][1].suite
    if not suite.goal:
        return None
    columns = [goal_rows(suite, run.records) for _, run in runs]
    last = columns[-1]
    return Goals(
        tuple(label or "measured" for label, _ in runs),
        tuple(_line(rows) for rows in zip(*columns, strict=True)),
        sum(row.met for row in last),
        sum(_open(row) for row in last),
        _named([metric_named(row.goal.metric) for row in last if not row.met and not _open(row)]),
    )


def _line(rows: Sequence[GoalRow]) -> GoalLine:
    metric = metric_named(rows[0].goal.metric)
    return GoalLine(
        metric.title,
        headed(metric.name),
        _where(rows[0]),
        rows[0].variant,
        _wanted(rows[0], metric.unit),
        tuple(_cell(row, metric.unit) for row in rows),
    )


def _wanted(row: GoalRow, unit: str) -> str:
    low, high = row.goal.at_least, row.goal.at_most
    if low is not None and high is not None:
        return f"{shown(low, unit)} to {shown(high, unit)}"
    return f"≥ {shown(low, unit)}" if low is not None else f"≤ {shown(high or 0.0, unit)}"


def _cell(row: GoalRow, unit: str) -> GoalCell:
    if _open(row):
        return GoalCell("–", "soft", "not run" if not row.cases else "–", row.cases)
    sign, css = ("✓", "better") if row.met else ("✗", "worse")
    return GoalCell(sign, css, "failed" if math.isinf(row.measured) else shown(row.measured, unit), row.cases)


def _open(row: GoalRow) -> bool:
    """Whether there is nothing to judge by."""
    return math.isnan(row.measured)


def _named(metrics: Sequence[Metric]) -> str:
    """Each metric once, with a number where it stands for several goals."""
    counts = Counter(within(metric.title) for metric in metrics)
    return ", ".join(f"{title} ({count})" if count > 1 else title for title, count in counts.items())


def _where(row: GoalRow) -> str:
    """Which cases, without the groups that parameters stand in."""
    return ", ".join(f"{path.rpartition('.')[2]} {value}" for path, value in row.goal.where.items()) or "all"
