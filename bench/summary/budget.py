"""A run's error budget: what each stage costs, per variant and metric."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from bench.budget.budget import METRICS, SUBSTITUTIONS
from bench.run.records import Record
from bench.score.metrics import metric_named
from bench.summary.table import middle


@dataclass(frozen=True)
class BudgetRow:
    """One metric of one variant.

    Parameters
    ----------
    variant, metric
        Which.
    cases
        How many cases have a budget.
    left
        Substitution to the metric with the truth up to and including that stage: a median over cases for
        errors in units, a mean for shares and counts, as in the score table.

    """

    variant: str
    metric: str
    cases: int
    left: Mapping[str, float]

    @property
    def cost(self) -> dict[str, float]:
        """Stage to how much worse the metric is for that stage's own errors; below 0 where they helped."""
        names = list(self.left)
        sign = 1.0 if metric_named(self.metric).better == "lower" else -1.0
        return {
            after: sign * (self.left[before] - self.left[after])
            for before, after in itertools.pairwise(names)
        }


def budget_rows(records: Sequence[Record]) -> list[BudgetRow]:
    """The budget of every variant that has one. O(records)."""
    variants = list(dict.fromkeys(record.variant for record in records if record.budget))
    return [_row(records, variant, metric) for variant in variants for metric in METRICS]


def _row(records: Sequence[Record], variant: str, metric: str) -> BudgetRow:
    mine = [record.budget for record in records if record.variant == variant and record.budget]
    names = [name for name in SUBSTITUTIONS if any(name in budget for budget in mine)]
    values = {name: [budget[name][metric] for budget in mine if name in budget] for name in names}
    return BudgetRow(variant, metric, len(mine), {name: middle(metric, v) for name, v in values.items()})
