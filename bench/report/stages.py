"""Where the error comes from: each metric as bars, a stage's share of it per bar."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from markupsafe import Markup

from bench.report.forest import headed, shown
from bench.report.sides import Panel, Side
from bench.score.metrics import metric_named
from bench.summary.budget import BudgetRow, budget_rows

_WIDTH, _HEIGHT = 320.0, 16.0
"""Of a bar's plot, in units that the page scales."""
STAGES = ("decoding", "triangulation", "coverage", "axis", "generatrix", "burrs")
"""In the order of the pipeline; each has a colour of its own on the page."""


@dataclass(frozen=True)
class StageBar:
    """One metric of one side: the whole error, what is left with all truths, and what each stage costs."""

    side: str
    css: str
    whole: str
    left: str
    cells: tuple[str, ...]
    bar: Markup


@dataclass(frozen=True)
class StageMetric:
    """A metric's bars, one per side, on one scale."""

    title: str
    unit: str
    bars: tuple[StageBar, ...]


@dataclass(frozen=True)
class StageBudget:
    """All metrics, and the stages that were replaced in any of them."""

    stages: tuple[str, ...]
    cases: int
    metrics: tuple[StageMetric, ...]


def stage_budget(panel: Panel) -> StageBudget | None:
    """The budget of a panel's sides; None where no record has one."""
    rows = [(side, row) for side in panel.sides for row in budget_rows(list(side.records.values()))]
    if not rows:
        return None
    stages = tuple(stage for stage in STAGES if any(stage in row.left for _, row in rows))
    names = list(dict.fromkeys(row.metric for _, row in rows))
    metrics = [
        _metric(name, [(side, row) for side, row in rows if row.metric == name], stages) for name in names
    ]
    return StageBudget(
        stages, max(row.cases for _, row in rows), tuple(metric for metric in metrics if metric.bars)
    )


def _metric(name: str, rows: Sequence[tuple[Side, BudgetRow]], stages: Sequence[str]) -> StageMetric:
    metric = metric_named(name)
    costs = [{k: v for k, v in row.cost.items() if math.isfinite(v)} for _, row in rows]
    reach = max((sum(abs(v) for v in cost.values()) for cost in costs), default=0.0)
    bars = tuple(
        _bar(side, row, cost, stages, reach, metric.unit)
        for (side, row), cost in zip(rows, costs, strict=True)
        if math.isfinite(row.left["none"])
    )
    return StageMetric(metric.title, headed(name), bars)


def _bar(
    side: Side, row: BudgetRow, cost: Mapping[str, float], stages: Sequence[str], reach: float, unit: str
) -> StageBar:
    last = list(row.left)[-1]
    return StageBar(
        side.label,
        side.css,
        shown(row.left["none"], unit),
        shown(row.left[last], unit),
        tuple(_cost(cost.get(stage, math.nan), unit) for stage in stages),
        _picture(cost, stages, reach),
    )


def _cost(value: float, unit: str) -> str:
    text = shown(value, unit, sign=True)
    return text if any(digit in "123456789–∞" for digit in text) else "0"


def _picture(cost: Mapping[str, float], stages: Sequence[str], reach: float) -> Markup:
    """What stages cost, end to end from the left; where a stage's errors helped its bar is hollow."""
    parts, x = [], 0.0
    for stage in stages:
        width = abs(cost.get(stage, 0.0)) / reach * _WIDTH if reach else 0.0
        if width >= 0.5:
            css = f"stage s{STAGES.index(stage)}{' helped' if cost[stage] < 0.0 else ''}"
            parts.append(
                Markup(
                    '<rect class="{}" x="{:.1f}" y="1" width="{:.1f}" height="{:g}"><title>{}</title></rect>'
                ).format(css, x, max(width - 1.0, 0.5), _HEIGHT - 2.0, stage)
            )
        x += width
    return Markup('<svg class="stagebar" viewBox="0 0 {:g} {:g}" role="img" aria-label="{}">{}</svg>').format(
        _WIDTH, _HEIGHT, "error by stage", Markup("").join(parts)
    )
