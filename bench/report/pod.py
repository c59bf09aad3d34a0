"""Detection curves of the sides of a page, by both models, with the false calls they were bought with."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup

from bench.detection import Detection, PodCurve, detection, of_one_size, sections
from bench.detection.records import Model
from bench.plotting.axes import Axes, log_marks
from bench.report.sides import Panel
from burrscan.arrays import Floats

_MODELS: tuple[Model, ...] = ("hit/miss", "signal")
_TITLES = {"hit/miss": "Hit or miss", "signal": "Signal response: measured height"}
_SIZES = ("burr.height_mm", "burr.width_mm")
"""Swept sizes divide no curve: they are what it is drawn over."""
_MOST_BANDS = 3
"""Curves whose bands are drawn; more would hide each other."""
_SHARES = ((0.0, "0"), (25.0, "25"), (50.0, "50"), (75.0, "75"), (90.0, "90"), (100.0, "100"))
"""Ticks in per cent; 90 is what a90 is read off at."""


@dataclass(frozen=True)
class PodRow:
    """What one side detects, as texts; ``why_not`` where it has no size to state."""

    label: str
    css: str
    found: str
    sizes: tuple[str, str, str]
    false_calls: str
    false_calls_interval: str
    why_not: str


@dataclass(frozen=True)
class PodChart:
    """The curves of all sides by one model, and why some have no size to state (reason to labels)."""

    title: str
    picture: Markup
    rows: tuple[PodRow, ...]
    unit: str = "mm"

    @property
    def busy(self) -> bool:
        """Whether only curves are drawn."""
        return len(self.rows) > _MOST_BANDS

    @property
    def reasons(self) -> dict[str, str]:
        """Each reason once."""
        found: dict[str, list[str]] = {}
        for row in self.rows:
            if row.why_not:
                found.setdefault(row.why_not, []).append(row.label)
        return {why: ", ".join(labels) for why, labels in found.items()}


def pod_charts(panel: Panel) -> tuple[PodChart, ...]:
    """Both models' charts; none where there are no burrs."""
    return tuple(chart for model in _MODELS for chart in _charts(panel, model))


def _charts(
    panel: Panel,
    model: Model,
    *,
    title: str = "",
    where: Mapping[str, Any] | None = None,
    burrs: Mapping[str, Any] | None = None,
    size: str = "height_mm",
) -> Iterator[PodChart]:
    """One chart of all sides, or none where there is nothing to draw."""
    found = [
        (
            side.css,
            side.label,
            detection(
                panel.records_of(side), variant=side.variant, where=where, burrs=burrs, size=size, model=model
            ),
        )
        for side in panel.sides
    ]
    chart = pod_chart(found, title, model=model)
    if chart and (model != "signal" or any(item.curve for _, _, item in found)):
        yield chart


def pod_chart(
    found: Sequence[tuple[str, str, Detection]], title: str = "", *, model: Model = "hit/miss"
) -> PodChart | None:
    """What some sides (style class, label, detection) detect, of one size; None where no burr has a size."""
    sizes = [s.size for _, _, item in found for s in item.shares if s.size > 0.0]
    if not sizes:
        return None
    flat = of_one_size(np.array(sizes))
    curves = [(css, item) for css, _, item in found]
    return PodChart(
        title or ("Found or missed" if flat else _TITLES[model]),
        Markup("") if flat else pod_picture(curves, title or _TITLES[model]),
        tuple(_row(css, label, item) for css, label, item in found),
        "d'" if found[0][2].size_name == "dprime" else "mm",
    )


def pod_groups(panel: Panel) -> dict[str, list[PodChart]]:
    """Hit/miss charts by what divides the score table, by the burrs' sections and by detectability.

    Of what has several values; each kind with a title.
    """
    records = [record for side in panel.sides for record in panel.records_of(side)]
    found = {}
    for path in panel.sides[-1].run.suite.divided_by:
        values = {str(value): value for value in (record.parameters.get(path) for record in panel.records)}
        if path not in _SIZES and len(values) > 1:
            title = f"By {path.rpartition('.')[2].replace('_', ' ')}"
            found[title] = [_charts(panel, "hit/miss", title=k, where={path: v}) for k, v in values.items()]
    names = sections(records)
    if len(names) > 1:
        found["By the burr's section"] = [
            _charts(panel, "hit/miss", title=name, burrs={"section": name}) for name in names
        ]
    if any("dprime" in burr for record in records for burr in record.burrs):
        title = "Against d', the strength of its signal in the frames shown"
        found["By detectability"] = [_charts(panel, "hit/miss", title=title, size="dprime")]
    groups = {title: list(itertools.chain.from_iterable(charts)) for title, charts in found.items()}
    return {title: charts for title, charts in groups.items() if charts}


def pod_picture(found: Sequence[tuple[str, Detection]], label: str) -> Markup:
    """Curves, bands, shares found with exact bounds; a90 (full) and a90/95 (hollow) on the line of 90 %.

    Parameters
    ----------
    found
        Style class and what it detects.
    label
        For those who hear pictures.

    """
    sizes = [share.size for _, item in found for share in item.shares if share.size > 0.0]
    low, high = math.log10(min(sizes)) - 0.12, math.log10(max(sizes)) + 0.12
    name, _, unit = found[0][1].size_name.rpartition("_")
    axes = Axes(
        (low, high),
        (-3.0, 103.0),
        f"burr {name.replace('_', ' ')}, {unit}" if name else found[0][1].size_name,
        "probability of detection, %",
        270.0,
        log_marks(low, high),
        _SHARES,
    )
    parts = [axes.line(np.array([[low, 90.0], [high, 90.0]]), "zero")]
    busy = len(found) > _MOST_BANDS
    for number, (css, item) in enumerate(found):
        shift = (number - (len(found) - 1) / 2) * 0.012 * (high - low)
        parts.append(_drawn(axes, css, item, shift, busy=busy))
    return axes.svg(parts, label)


def _drawn(axes: Axes, css: str, item: Detection, shift: float, *, busy: bool) -> Markup:
    """One side; where there are many, their curves alone."""
    parts = [_curve(axes, item.curve, busy=busy)] if item.curve else []
    for share in (share for share in item.shares if share.size > 0.0 and not busy):
        x = math.log10(share.size) + shift
        parts.append(axes.line(100.0 * np.array([[x / 100.0, share.low], [x / 100.0, share.high]]), "bound"))
        parts.append(axes.dot(x, 100.0 * share.hits / share.trials, "share", 3.2))
    return Markup('<g class="{}">{}</g>').format(css, Markup("").join(parts))


def _curve(axes: Axes, fit: PodCurve, *, busy: bool) -> Markup:
    x = np.log10(np.maximum(fit.size, 1e-12))
    marks = [
        axes.dot(math.log10(size), 90.0, css, 4.5)
        for size, css in ((fit.a90, "a90"), (fit.a90_95, "a90 bound"))
        if fit.size[0] <= size <= fit.size[-1]
    ]
    band = np.concatenate([_points(x, fit.low), _points(x, fit.high)[::-1]])
    shade = Markup("") if busy else axes.area(band, "band")
    return Markup("").join([shade, axes.line(_points(x, fit.pod), "curve"), *marks])


def _points(x: Floats, pod: Floats) -> Floats:
    return np.column_stack([x, 100.0 * pod])


def _row(css: str, label: str, item: Detection) -> PodRow:
    fit, why_not = item.curve, item.why_not
    low, high = item.false_calls_interval
    if fit and fit.pod[-1] < fit.pod[0]:
        why_not = "larger burrs were found less often than smaller ones"
    hits, trials = sum(s.hits for s in item.shares), sum(s.trials for s in item.shares)
    interval = f"{_digits(low)}–{_digits(high)}" if math.isfinite(low) and math.isfinite(high) else ""
    return PodRow(
        label,
        css,
        f"{hits}/{trials}",
        told_sizes(fit) if fit and not why_not else ("", "", "no size"),
        _digits(item.false_calls_per_wheel) if item.wheels else "–",
        interval,
        why_not,
    )


def told_sizes(fit: PodCurve) -> tuple[str, str, str]:
    """a50, a90 and a90/95 as texts."""
    return fit.told(fit.a50), fit.told(fit.a90), fit.told(fit.a90_95)


def _digits(value: float) -> str:
    return f"{value:.2f}" if value < 10.0 else f"{value:.0f}"
