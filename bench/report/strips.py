"""The score of one variant: a row per metric, every case a dot about the median case, in margins."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from bench.compare.margins import margin_of
from bench.report.forest import (
    HEIGHT,
    WIDTH,
    axis,
    band,
    diamond,
    headed,
    place,
    reach_of,
    shown,
    upright,
)
from bench.report.sides import Side
from bench.run import Record
from bench.score.metrics import metric_named
from bench.summary.table import summarise, value_of
from burrscan.arrays import Floats

_JITTER_PX = (0.0, -4.0, 4.0, -2.0, 2.0)
"""Heights of dots in turn, so that like cases do not hide each other."""


@dataclass(frozen=True)
class StripRow:
    """One metric: its score, the middle half of its cases, and the plot."""

    title: str
    unit: str
    margin: str
    value: str
    half: str
    worst: str
    plot: Markup


@dataclass(frozen=True)
class Strips:
    """All metrics that some case has, under one axis."""

    axis: Markup
    rows: tuple[StripRow, ...]


def strips(side: Side, names: Sequence[str]) -> Strips:
    """Lay out a side's cases; those without a value are left out of the plots, not of the score."""
    records = list(side.records.values())
    found = {name: _values(records, name) for name in names}
    known = {name: values for name, values in found.items() if values.size}
    reach = reach_of([float(v) for name, values in known.items() for v in _in_margins(values, name)])
    return Strips(axis(reach), tuple(_row(records, name, values, reach) for name, values in known.items()))


def _values(records: Sequence[Record], name: str) -> Floats:
    values = [value_of(record, name) for record in records if record.failure is None]
    return np.array([value for value in values if math.isfinite(value)], float)


def _in_margins(values: Floats, name: str) -> Floats:
    """About the median; better is positive."""
    sign = 1.0 if metric_named(name).better == "higher" else -1.0
    return np.asarray(sign * (values - np.median(values)) / (margin_of(name) or 1.0), float)


def _row(records: Sequence[Record], name: str, values: Floats, reach: float) -> StripRow:
    metric = metric_named(name)
    low, high = (shown(float(v), metric.unit) for v in np.percentile(values, (25.0, 75.0)))
    worst = float(values.min() if metric.better == "higher" else values.max())
    failed = any(record.failure for record in records)
    return StripRow(
        metric.title,
        headed(name),
        f"±{shown(margin_of(name), metric.unit)}",
        shown(summarise(name, records), metric.unit),
        f"{low} to {high}" if low != high else low,
        "failed" if failed else shown(worst, metric.unit),
        _plot(_in_margins(values, name), reach, metric.title),
    )


def _plot(margins: Floats, reach: float, title: str) -> Markup:
    dots = [
        Markup('<circle class="one" cx="{:.1f}" cy="{:.1f}" r="2.4"/>').format(
            place(float(v), reach), HEIGHT / 2 + _JITTER_PX[number % len(_JITTER_PX)]
        )
        for number, v in enumerate(margins)
    ]
    parts = [band(reach), upright(place(0.0, reach), "zero"), *dots, diamond(place(0.0, reach), HEIGHT / 2)]
    return Markup(
        '<svg class="row strip" viewBox="0 0 {:g} {:g}" role="img" aria-label="{}">{}</svg>'
    ).format(WIDTH, HEIGHT, f"{title}: {len(margins)} cases about their median", Markup("").join(parts))
