"""Where: a metric over two swept parameters, as a table of coloured numbers."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bench.compare.margins import margin_of
from bench.report.forest import headed, shown, signed
from bench.report.sides import Panel
from bench.run import Record
from bench.run.records import count_failed
from bench.score.metrics import metric_named
from bench.suites.cases import POINT
from bench.summary.table import summarise

_MOST_VALUES = 8  # of a number; more are put into groups of equal size
_MOST_GROUPS = 5
"""Along a side of a table of a random design, so that a cell holds some scenes."""
_SCENES = 4  # of a random design in a cell of two parameters, about: fewer say nothing
_BESIDE = 2  # sides that are shown beside each other; more are shown one at a time
_DARKEST = 0.62
"""Opacity of a full colour: the number on it must stay readable."""
_SATURATED = 30.0  # margins at which a difference has its full colour
_LETTER_PX, _CELL_PX = 7, 64
"""Widths by which a table is judged to fit beside another."""
_NOT_SWEPT = {"seed", POINT}

Key = tuple[str, str]


@dataclass(frozen=True)
class HeatCell:
    """A number, how strong its colour is, and failures of its cases."""

    text: str
    css: str
    strength: float
    failed: int
    cases: int


@dataclass(frozen=True)
class HeatTable:
    """One metric: rows of cells under the values of the second parameter."""

    title: str
    unit: str
    side: str
    side_css: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, tuple[HeatCell, ...]], ...]


@dataclass(frozen=True)
class HeatView:
    """All metrics over one pair of parameters, or over one parameter: what is shown at a time."""

    down: str
    across: str
    tables: tuple[HeatTable, ...]

    @property
    def width_px(self) -> int:
        """What its tables need, by the letters in their heads; heads break between words."""
        words = [max(map(len, name.split(" "))) for table in self.tables[:1] for name in table.columns]
        names = [len(name) for table in self.tables[:1] for name, _ in table.rows]
        return (
            max(names, default=0) * _LETTER_PX + sum(max(n * _LETTER_PX + 16, _CELL_PX) for n in words) + 24
        )


@dataclass(frozen=True)
class HeatViews:
    """What can be chosen: parameters, and a side where there are many; a view for each choice of both."""

    parameters: tuple[str, ...]
    sides: tuple[str, ...]
    views: tuple[HeatView, ...]


def heat_views(panel: Panel, metrics: Sequence[str]) -> HeatViews:
    """Every pair of swept parameters, all others averaged over. O(pairs × metrics × cases)."""
    groups = {name: group for name, group in _groupings(panel.records).items() if len(group.names) > 1}
    pairs: list[tuple[str, ...]] = list(itertools.combinations(groups, 2)) or [(name,) for name in groups]
    together = panel.paired or len(panel.sides) <= _BESIDE
    shown = [panel] if together else [replace(panel, sides=(side,)) for side in panel.sides]
    return HeatViews(
        tuple(" × ".join(pair) for pair in pairs),
        () if together else tuple(side.label for side in panel.sides),
        tuple(_view(one, metrics, pair, groups) for pair in pairs for one in shown),
    )


@dataclass(frozen=True)
class _Grouping:
    """Into which group a parameter's value belongs."""

    names: tuple[str, ...]
    of: Callable[[Any], str]


def _groupings(records: Sequence[Record]) -> dict[str, _Grouping]:
    names = dict.fromkeys(name for record in records for name in record.parameters if name not in _NOT_SWEPT)
    return {name: _grouping([r.parameters[name] for r in records if name in r.parameters]) for name in names}


def _grouping(values: Sequence[Any]) -> _Grouping:
    different = list(dict.fromkeys(values))
    if len(different) <= _MOST_VALUES or not all(isinstance(value, int | float) for value in different):
        return _Grouping(tuple(str(value) for value in different), str)
    count = min(max(math.isqrt(len(different) // _SCENES), 2), _MOST_GROUPS)
    edges = np.quantile(np.array(different, float), np.linspace(0.0, 1.0, count + 1))
    names = tuple(f"{a:.3g}\u00a0to {b:.3g}" for a, b in itertools.pairwise(edges))
    return _Grouping(names, lambda v: names[int(np.searchsorted(edges[1:-1], v, side="right"))])


def _view(
    panel: Panel, metrics: Sequence[str], pair: tuple[str, ...], groups: Mapping[str, _Grouping]
) -> HeatView:
    down, across = pair[0], pair[1] if len(pair) > 1 else ""
    keys = [(a, b) for a in groups[down].names for b in (groups[across].names if across else ("",))]

    def key(record: Record) -> Key:
        second = groups[across].of(record.parameters[across]) if across else ""
        return groups[down].of(record.parameters[down]), second

    make = _differences if panel.paired else _values
    return HeatView(down, across, tuple(table for name in metrics for table in make(panel, name, keys, key)))


def _values(panel: Panel, name: str, keys: Sequence[Key], key: Callable[[Record], Key]) -> list[HeatTable]:
    """A table per side; the darker, the worse, between the best and the worst cell of the metric."""
    metric, sign = metric_named(name), 1.0 if metric_named(name).better == "lower" else -1.0
    parts = [_parted(list(side.records.values()), key) for side in panel.sides]
    numbers = [[summarise(name, part.get(k, ())) for k in keys] for part in parts]
    known = [sign * v for row in numbers for v in row if math.isfinite(v)]
    if not known:
        return []
    best, worst = min(known), max(known)
    tables = []
    for side, part, row in zip(panel.sides, parts, numbers, strict=True):
        cells = {
            k: _cell(part.get(k, ()), value, metric.unit, "dark", _share(sign * value, best, worst))
            for k, value in zip(keys, row, strict=True)
        }
        label = side.label if len(panel.sides) > 1 else ""
        tables.append(_table(metric.title, headed(name), label, side.css, keys, cells))
    return tables


def _differences(
    panel: Panel, name: str, keys: Sequence[Key], key: Callable[[Record], Key]
) -> list[HeatTable]:
    """New minus base of the cases that both have: one colour for worse, one for better."""
    metric, margin = metric_named(name), margin_of(name) or 1.0
    base, new = panel.sides
    both = base.records.keys() & new.records.keys()
    ours, theirs = (
        _parted([r for case, r in side.records.items() if case in both], key) for side in (base, new)
    )
    cells = {}
    for k in keys:
        value = summarise(name, theirs.get(k, ())) - summarise(name, ours.get(k, ()))
        worse = value * (1.0 if metric.better == "lower" else -1.0) / margin
        css = "dark" if worse > 0.0 else "good"
        cells[k] = _cell(theirs.get(k, ()), value, metric.unit, css, _strength(worse), sign=True)
    if not any(cell.text != "–" for cell in cells.values()):
        return []
    return [_table(metric.title, headed(name, difference=True), "", "", keys, cells)]


def _strength(margins: float) -> float:
    if not math.isfinite(margins):
        return _DARKEST
    return min(math.asinh(abs(margins)) / math.asinh(_SATURATED), 1.0) * _DARKEST


def _share(value: float, best: float, worst: float) -> float:
    if not math.isfinite(value):
        return _DARKEST
    return _DARKEST * (value - best) / (worst - best) if worst > best else 0.0


def _parted(records: Sequence[Record], key: Callable[[Record], Key]) -> dict[Key, list[Record]]:
    parts: dict[Key, list[Record]] = {}
    for record in records:
        parts.setdefault(key(record), []).append(record)
    return parts


def _cell(
    records: Sequence[Record], value: float, unit: str, css: str, strength: float, *, sign: bool = False
) -> HeatCell:
    failed = count_failed(records)
    text = "failed" if records and failed == len(records) else _text(value, unit, sign=sign)
    return HeatCell(text, "none" if text == "–" else css, strength, failed, len(records))


def _text(value: float, unit: str, *, sign: bool) -> str:
    """Three digits do in a cell."""
    if unit == "1" and math.isfinite(value):
        return signed(f"{100.0 * value:.1f}", sign=sign)
    if math.isfinite(value) and unit not in {"1", "count"}:
        return signed(f"{value:.3f}", sign=sign)
    return shown(value, unit, sign=sign)


def _table(
    title: str, unit: str, side: str, css: str, keys: Sequence[Key], cells: Mapping[Key, HeatCell]
) -> HeatTable:
    down = list(dict.fromkeys(a for a, _ in keys))
    across = list(dict.fromkeys(b for _, b in keys))
    rows = tuple((a, tuple(cells[a, b] for b in across)) for a in down)
    return HeatTable(title, unit, side, css, tuple(across) if across != [""] else (), rows)
