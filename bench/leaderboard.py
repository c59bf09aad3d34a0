"""The leaderboard of a run: variants × metrics, the best of each column in bold, as Markdown."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from bench.detection.records import detection
from bench.run.directory import Run
from bench.run.records import count_failed
from bench.score.metric import shown_unit
from bench.score.metrics import HEADLINE, metric_named
from bench.summary.table import summarise, typical

_SIZES = {"a50": "a50, mm", "a90": "a90, mm", "a90_95": "a90/95, mm"}
"""Attributes of a detection curve, and how tables call them."""


@dataclass(frozen=True)
class Column:
    """One measure of every variant.

    Parameters
    ----------
    title
        With its unit.
    values
        One per variant; NaN where there is none.
    texts
        The same for people.
    higher
        Whether more is better.

    """

    title: str
    values: tuple[float, ...]
    texts: tuple[str, ...]
    higher: bool

    def rank(self, place: int) -> float:
        """How many variants are better than one, half of those that are equal; without a value, all are."""
        mine = _key(self.values[place], higher=self.higher)
        others = [_key(v, higher=self.higher) for i, v in enumerate(self.values) if i != place]
        return sum((other < mine) + 0.5 * (other == mine) for other in others)


def leaderboard(run: Run) -> str:
    """The table, variants with the least mean rank over its columns first. O(records × metrics)."""
    names = [variant.name for variant in run.suite.variant]
    metrics = [_metric_column(run, names, metric) for metric in run.suite.metrics or HEADLINE]
    columns = [*metrics, *_size_columns(run, names)]
    failed = [count_failed(record for record in run.records if record.variant == name) for name in names]
    order = sorted(range(len(names)), key=lambda place: sum(column.rank(place) for column in columns))
    head = ["variant", "failed", *(column.title for column in columns)]
    rows = [[names[i], str(failed[i]), *(_cell(column, i) for column in columns)] for i in order]
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _metric_column(run: Run, names: Sequence[str], name: str) -> Column:
    metric = metric_named(name)
    values = tuple(summarise(name, [r for r in run.records if r.variant == v]) for v in names)
    share = metric.unit == "1"
    texts = tuple(_number(100.0 * value, ".1f") if share else _number(value, ".3g") for value in values)
    title = f"{metric.title}, {typical(name)} {shown_unit(metric.unit)}".strip()
    return Column(title, values, texts, metric.better == "higher")


def _size_columns(run: Run, names: Sequence[str]) -> list[Column]:
    """Burr heights that are found with a probability of 0.5 and 0.9, where a curve fits.

    Beyond the heights that were tried none is known: those are the last in their column.
    """
    curves = [detection(run.records, variant=name).curve for name in names]
    if not any(curves):
        return []
    columns = []
    for attribute, title in _SIZES.items():
        sizes = [(curve, float(getattr(curve, attribute))) if curve else (None, math.nan) for curve in curves]
        texts = tuple(curve.told(size) if curve else "–" for curve, size in sizes)
        tried = tuple(math.inf if curve and size > curve.size[-1] else size for curve, size in sizes)
        columns.append(Column(title, tried, texts, higher=False))
    return columns


def _cell(column: Column, place: int) -> str:
    best = math.isfinite(column.values[place]) and column.rank(place) < 0.5
    return f"**{column.texts[place]}**" if best else column.texts[place]


def _key(value: float, *, higher: bool) -> float:
    """Smaller is better."""
    return math.inf if math.isnan(value) else -value if higher else value


def _number(value: float, form: str) -> str:
    return format(value, form) if math.isfinite(value) else "–"
