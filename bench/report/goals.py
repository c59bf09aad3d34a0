"""A suite's goals as a table: what was asked for, what was measured, met or missed."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from bench.report.forest import shown
from bench.run import Run
from bench.score.metric import within
from bench.score.metrics import metric_named
from bench.summary.goals import GoalRow, goal_rows


@dataclass(frozen=True)
class Goals:
    """All goals of a suite: each with what every run made of it, the last run's last."""

    heads: tuple[str, ...]
    lines: tuple[tuple[GoalRow, ...], ...]

    @property
    def last(self) -> list[GoalRow]:
        """What the last run made of them."""
        return [line[-1] for line in self.lines]

    @property
    def missed(self) -> str:
        """Each metric once, with a number where it stands for several goals."""
        missed = [row for row in self.last if not row.met and not row.open]
        counts = Counter(within(metric_named(row.goal.metric).title) for row in missed)
        return ", ".join(f"{title} ({count})" if count > 1 else title for title, count in counts.items())


def goals(runs: Sequence[tuple[str, Run]]) -> Goals | None:
    """The goals of the last run's suite, measured in every run; None where it has none."""
    suite = runs[-1][1].suite
    if not suite.goal:
        return None
    columns = [goal_rows(suite, run.records) for _, run in runs]
    return Goals(tuple(label or "measured" for label, _ in runs), tuple(zip(*columns, strict=True)))


def wanted(row: GoalRow) -> str:
    """The goal's bounds as text."""
    low, high, unit = row.goal.at_least, row.goal.at_most, metric_named(row.goal.metric).unit
    if low is not None and high is not None:
        return f"{shown(low, unit)} to {shown(high, unit)}"
    return f"≥ {shown(low, unit)}" if low is not None else f"≤ {shown(high or 0.0, unit)}"


def measured(row: GoalRow) -> str:
    """What a run measured, as text."""
    if row.open:
        return "–" if row.cases else "not run"
    return "failed" if math.isinf(row.measured) else shown(row.measured, metric_named(row.goal.metric).unit)


def where(row: GoalRow) -> str:
    """Which cases, without the groups that parameters stand in."""
    return ", ".join(f"{path.rpartition('.')[2]} {value}" for path, value in row.goal.where.items()) or "all"
