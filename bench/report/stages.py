"""Where the error comes from: each metric as bars, a stage's share of it per bar."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

from bench.report.forest import shown
from bench.report.sides import Panel, Side
from bench.score.metrics import metric_named
from bench.summary.budget import BudgetRow, budget_rows

_WIDTH, _HEIGHT = 320.0, 16.0
"""Of a bar's plot, in units that the page scales."""
STAGES = ("decoding", "triangulation", "coverage", "axis", "generatrix", "burrs")
"""In the order of the pipeline; each has a colour of its own on the page."""


@dataclass(frozen=True)
class StageBudget:
    """The stages that were replaced in any metric; a metric's rows, each with its side and its bar."""

    stages: tuple[str, ...]
    cases: int
    metrics: dict[str, list[tuple[Side, BudgetRow, Markup]]]


def stage_budget(panel: Panel) -> StageBudget | None:
    """The budget of a panel's sides; None where no record has one."""
    rows = [(side, row) for side in panel.sides for row in budget_rows(list(side.records.values()))]
    if not rows:
        return None
    stages = tuple(stage for stage in STAGES if any(stage in row.left for _, row in rows))
    metrics: dict[str, list[tuple[Side, BudgetRow, Markup]]] = {}
    for side, row in rows:
        reach = max(sum(_finite(one).values()) for _, one in rows if one.metric == row.metric)
        if math.isfinite(row.left["none"]):
            metrics.setdefault(row.metric, []).append((side, row, _picture(row, stages, reach)))
    return StageBudget(stages, max(row.cases for _, row in rows), metrics)


def _finite(row: BudgetRow) -> dict[str, float]:
    """What stages cost, where that is known, without its sign."""
    return {stage: abs(cost) for stage, cost in row.cost.items() if math.isfinite(cost)}


def stage_cost(row: BudgetRow, stage: str) -> str:
    """What one stage costs, as text."""
    cost = row.cost.get(stage, math.nan)
    text = shown(cost if math.isfinite(cost) else math.nan, metric_named(row.metric).unit, sign=True)
    return text if any(digit in "123456789–∞" for digit in text) else "0"


def _picture(row: BudgetRow, stages: Sequence[str], reach: float) -> Markup:
    """What stages cost, end to end from the left; where a stage's errors helped its bar is hollow."""
    parts, x, sizes = [], 0.0, _finite(row)
    for stage in stages:
        width = sizes.get(stage, 0.0) / reach * _WIDTH if reach else 0.0
        if width >= 0.5:
            css = f"stage s{STAGES.index(stage)}{' helped' if row.cost[stage] < 0.0 else ''}"
            parts.append(
                Markup(
                    '<rect class="{}" x="{:.1f}" y="1" width="{:.1f}" height="{:g}"><title>{}</title></rect>'
                ).format(css, x, max(width - 1.0, 0.5), _HEIGHT - 2.0, stage)
            )
        x += width
    return Markup('<svg class="stagebar" viewBox="0 0 {:g} {:g}" role="img" aria-label="{}">{}</svg>').format(
        _WIDTH, _HEIGHT, "error by stage", Markup("").join(parts)
    )
