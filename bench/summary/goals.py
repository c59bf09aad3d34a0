"""A suite's goals beside what was measured: which are met."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from bench.run.records import Record
from bench.suites.suite import Goal, Suite
from bench.summary.table import summarise


@dataclass(frozen=True)
class GoalRow:
    """One goal.

    Parameters
    ----------
    goal
        What was asked for.
    variant
        Of whom.
    cases
        How many cases it is about.
    measured
        The metric over them, summarised as in the score table; NaN where no case has it.

    """

    goal: Goal
    variant: str
    cases: int
    measured: float

    @property
    def met(self) -> bool:
        """Whether it is within the goal's bounds; what was not measured is not met."""
        low = -math.inf if self.goal.at_least is None else self.goal.at_least
        high = math.inf if self.goal.at_most is None else self.goal.at_most
        return low <= self.measured <= high

    @property
    def open(self) -> bool:
        """Whether there is nothing to judge by."""
        return math.isnan(self.measured)

    @property
    def where(self) -> str:
        """Which cases, in words."""
        return ", ".join(f"{path} = {value}" for path, value in self.goal.where.items()) or "all"


def goal_rows(suite: Suite, records: Sequence[Record]) -> list[GoalRow]:
    """Every goal of a suite, as far as its cases have been run. O(goals × records)."""
    return [_row(suite, goal, records) for goal in suite.goal]


def _row(suite: Suite, goal: Goal, records: Sequence[Record]) -> GoalRow:
    variant = goal.variant or suite.variant[0].name
    about = [record for record in records if record.variant == variant and _fits(record, goal)]
    return GoalRow(goal, variant, len(about), summarise(goal.metric, about) if about else math.nan)


def _fits(record: Record, goal: Goal) -> bool:
    return all(record.parameters.get(path) == value for path, value in goal.where.items())
