"""The forest plot: every metric's difference and interval in units of its margin, better to the right."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

from bench.compare.result import ArmComparison, Row
from bench.compare.text import number
from bench.score.metric import shown_unit
from bench.score.metrics import metric_named
from bench.summary.table import typical

WIDTH, HEIGHT = 320.0, 24.0
"""Of a row's plot, in units that the page scales."""
_SIDE = 12.0
"""Room at both ends, so that a mark there is whole."""
_TICKS = (1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0)
"""In margins; the axis is logarithmic far from zero."""
_ROOM = {1: 22.0, 2: 28.0, 3: 34.0, 4: 40.0}  # that a tick's text needs, by its length
_LEAST = 4.0  # margins that the axis shows on each side, at least
_MOST = 1000.0
"""Margins that the axis shows at most: beyond, only that it is far matters."""


@dataclass(frozen=True)
class Forest:
    """A comparison's rows under one axis, each with its plot."""

    axis: Markup
    rows: tuple[tuple[Row, Markup], ...]


def forest(arm: ArmComparison) -> Forest:
    """Lay out a comparison, gated metrics first; those that no case has are left out."""
    reach = _reach(arm.rows)
    known = [row for row in arm.rows if row.verdict == "not comparable" or not math.isnan(row.difference)]
    rows = sorted(known, key=lambda row: not row.gated)
    return Forest(axis(reach), tuple((row, _plot(row, reach)) for row in rows))


def interval(row: Row) -> str:
    """A difference's interval and its level; nothing where there is none, or it has no width."""
    if not (math.isfinite(row.low) and row.low < row.high):
        return ""
    low, high = (shown(value, row.unit, sign=True) for value in (row.low, row.high))
    return f"{low} to {high} ({100 * row.level:.3g} %)"


def shown(value: float, unit: str, *, sign: bool = False) -> str:
    """A value as text with a true minus, shares in per cent."""
    return signed(number(value, unit), sign=sign)


def signed(text: str, *, sign: bool) -> str:
    """A number's text with a true minus, a plus where signs are wanted; zero has neither."""
    if not any(digit in "123456789" for digit in text):
        return text.removeprefix("-") if any(letter.isdigit() for letter in text) else text
    return text.replace("-", "−") if text.startswith("-") or not sign else f"+{text}"


def headed(name: str, *, difference: bool = False) -> str:
    """What stands behind a title: mean or median, and the unit, points for a difference of shares."""
    unit = metric_named(name).unit
    words = (typical(name), "points" if difference and unit == "1" else shown_unit(unit))
    return ", ".join(word for word in words if word)


def points(unit: str) -> str:
    """What a difference of shares is in, after the number; nothing for other units."""
    return " points" if unit == "1" else ""


def _in_margins(value: float, row: Row) -> float:
    """Better is positive; a margin of zero counts as one."""
    sign = 1.0 if row.better == "higher" else -1.0
    return sign * value / (row.margin or 1.0)


def _reach(rows: Sequence[Row]) -> float:
    return reach_of([_in_margins(v, row) for row in rows for v in (row.difference, row.low, row.high)])


def reach_of(margins: Sequence[float]) -> float:
    """How many margins the axis shows: everything, if that is possible."""
    return min(max([_LEAST, *(1.15 * abs(end) for end in margins if math.isfinite(end))]), _MOST)


def place(margins: float, reach: float) -> float:
    """Horizontal place of a value: near zero the axis is even, far from it logarithmic (arsinh)."""
    share = math.asinh(margins) / math.asinh(reach)
    return WIDTH / 2 + min(max(share, -1.0), 1.0) * (WIDTH / 2 - _SIDE)


def _plot(row: Row, reach: float) -> Markup:
    middle = HEIGHT / 2
    parts = [band(reach), upright(place(0.0, reach), "zero")]
    if math.isfinite(row.difference):
        ends = sorted(place(_in_margins(v, row), reach) for v in (row.low, row.high) if math.isfinite(v))
        if ends and ends[-1] > ends[0]:
            parts.append(_whisker(ends[0], ends[-1], middle))
        parts.append(diamond(place(_in_margins(row.difference, row), reach), middle))
    words = f"{row.title}: {shown(row.difference, row.unit, sign=True)} {shown_unit(row.unit)}, {row.verdict}"
    return Markup('<svg class="row {}" viewBox="0 0 {:g} {:g}" role="img" aria-label="{}">{}</svg>').format(
        row.verdict.replace(" ", "-"), WIDTH, HEIGHT, words, Markup("").join(parts)
    )


def axis(reach: float) -> Markup:
    """The head of a column of plots: ticks in margins, and which way is better."""
    words = [_label(place(0.0, reach), "0", "tick x")]
    last = 0.0
    for tick in _TICKS:
        if tick > reach:
            break
        if place(tick, reach) - place(last, reach) > _ROOM[len(f"{tick:g}")]:
            words += [
                _label(place(s * tick, reach), f"{'+' if s > 0 else '−'}{tick:g}", "tick x") for s in (1, -1)
            ]
            last = tick
    words += [
        Markup('<text class="end" x="{:g}" y="9" text-anchor="start">← worse</text>').format(_SIDE),
        Markup('<text class="end" x="{:g}" y="9" text-anchor="middle">in margins</text>').format(WIDTH / 2),
        Markup('<text class="end" x="{:g}" y="9" text-anchor="end">better →</text>').format(WIDTH - _SIDE),
    ]
    return Markup('<svg class="row axis" viewBox="0 0 {:g} 26" aria-hidden="true">{}</svg>').format(
        WIDTH, Markup("").join(words)
    )


def _label(x: float, words: str, css: str) -> Markup:
    return Markup('<text class="{}" x="{:.1f}" y="23">{}</text>').format(css, x, words)


def band(reach: float) -> Markup:
    """What is within one margin."""
    left, right = place(-1.0, reach), place(1.0, reach)
    return Markup('<rect class="margin" x="{:.1f}" y="0" width="{:.1f}" height="{:g}"/>').format(
        left, right - left, HEIGHT
    )


def upright(x: float, css: str) -> Markup:
    """A line over the height of a row."""
    return Markup('<path class="{0}" d="M{1:.1f} 0V{2:g}"/>').format(css, x, HEIGHT)


def _whisker(x0: float, x1: float, y: float) -> Markup:
    return Markup(
        '<path class="whisker" d="M{0:.1f} {2:g}H{1:.1f}M{0:.1f} {3:g}v8M{1:.1f} {3:g}v8"/>'
    ).format(x0, x1, y, y - 4)


def diamond(x: float, y: float) -> Markup:
    """The mark of an estimate."""
    return Markup('<path class="estimate" d="M{:.1f} {:g}l5.5 5.5l-5.5 5.5l-5.5 -5.5z"/>').format(x, y - 5.5)
