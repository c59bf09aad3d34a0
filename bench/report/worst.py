"""Which cases to show: those that changed most for the worse, or those that stand out for the worse."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bench.compare.result import CaseChange
from bench.report.forest import shown
from bench.report.sides import Panel, Side
from bench.run import Record
from bench.score.metric import shown_unit, within
from bench.score.metrics import METRICS, metric_named
from bench.summary.table import value_of

_SMALLEST_MARGIN = 1e-9  # a margin of zero would make every case stand out without end


@dataclass(frozen=True)
class Chosen:
    """A case to show, why, how many margins it is worse, and of which sides the pictures say so."""

    case: str
    panel: Panel
    reason: str
    margins: float
    sides: tuple[Side, ...]
    kind: tuple[str, str] = ("", "")
    """Whose, and which metric."""


def worst_changed(panels: Sequence[Panel], most: int) -> list[Chosen]:
    """The cases that got worse most in any panel, the worst first; none that did not get worse."""
    changed = [_change(panel, change) for panel in panels for arm in panel.arms for change in arm.cases]
    kept = sorted((item for item in changed if item.margins > 0.0), key=lambda item: -item.margins)
    return kept[:most]


def _change(panel: Panel, change: CaseChange) -> Chosen:
    if math.isinf(change.worst):
        return Chosen(change.case, panel, "newly failed", change.worst, panel.sides)
    title = metric_named(change.worst_metric).title
    why = f"{title}: worse by {_margins(change.worst)}"
    return Chosen(change.case, panel, why, change.worst, panel.sides)


def worst_of(panel: Panel, margins: Mapping[str, float], most: int) -> list[Chosen]:
    """The cases in which some side is farthest behind its own median, in margins; the worst first.

    The worst of each side and metric comes before the second worst of any: six cases that are bad in the same
    way would show one thing six times.

    Parameters
    ----------
    panel
        The sides.
    margins
        Metrics that count, with their margins.
    most
        How many cases at most.

    """
    worst: dict[str, Chosen] = {}
    for side in panel.sides:
        for item in _standing_out(panel, side, margins):
            if item.case not in worst or item.margins > worst[item.case].margins:
                worst[item.case] = item
    ranked = sorted(worst.values(), key=lambda item: -item.margins)
    first = {item.kind: item for item in reversed(ranked)}.values()
    others = [item for item in ranked if item not in first]
    kept = [*sorted(first, key=lambda item: -item.margins), *others][:most]
    return sorted(kept, key=lambda item: -item.margins)


def _standing_out(panel: Panel, side: Side, margins: Mapping[str, float]) -> Iterator[Chosen]:
    """Every case of a side with the metric in which it is farthest behind."""
    names = [name for name in margins if name in METRICS]
    records = list(side.records.values())
    if not records:
        return
    behind = np.array([_behind([value_of(r, name) for r in records], name, margins[name]) for name in names])
    name_of = f"{side.label}: " if len(panel.sides) > 1 else ""
    for number, record in enumerate(records):
        if record.failure is not None or not names:
            reason, excess, name = "", math.inf, ""  # the error is shown anyway
        else:
            first = int(behind[:, number].argmax())
            name, excess = names[first], float(behind[first, number])
            reason = f"{name_of}{_in_words(record, name, excess)}" if excess > 0.0 else ""
        sides = _pictured(panel, side, record.case, name)
        yield Chosen(record.case, panel, reason, excess, sides, (side.label, name))


def _in_words(record: Record, name: str, excess: float) -> str:
    metric = metric_named(name)
    value = f"{shown(value_of(record, name), metric.unit)} {shown_unit(metric.unit)}".strip()
    return f"{within(metric.title)} {value}, {_margins(excess)} behind the median case"


def _margins(count: float) -> str:
    return f"{count:.1f} margins" if count < 100.0 else f"{count:.0f} margins"


def _pictured(panel: Panel, side: Side, case: str, name: str) -> tuple[Side, ...]:
    """Two sides at most: the one that stands out, and the first, or the best if it is the first."""
    if len(panel.sides) <= 2:
        return panel.sides
    other = panel.sides[0] if side is not panel.sides[0] else _best(panel.sides[1:], case, name)
    return tuple(one for one in panel.sides if one in {side, other})


def _best(sides: Sequence[Side], case: str, name: str) -> Side:
    """The side that did best in a case; without a metric, the first that did not fail."""
    there = [side for side in sides if case in side.records and side.records[case].failure is None]
    if not there or not name:
        return (there or list(sides))[0]
    sign = 1.0 if metric_named(name).better == "lower" else -1.0
    values = [sign * value_of(side.records[case], name) for side in there]
    return there[int(np.argmin(np.nan_to_num(values, nan=np.inf)))]


def _behind(values: Sequence[float], name: str, margin: float) -> list[float]:
    """How far each value is worse than the median, in margins; no value is no reason."""
    found = np.array(values, float)
    known = found[np.isfinite(found)]
    if not known.size:
        return [0.0] * len(values)
    sign = 1.0 if metric_named(name).better == "lower" else -1.0
    excess = sign * (found - float(np.median(known))) / max(margin, _SMALLEST_MARGIN)
    return [float(v) for v in np.nan_to_num(excess, nan=0.0, posinf=0.0, neginf=0.0)]
