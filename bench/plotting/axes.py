"""A little SVG plotting: two axes with round ticks, in the page's own colours and fonts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import cv2
import numpy as np
from markupsafe import Markup

from burrscan.arrays import Floats

Number = TypeVar("Number", float, Floats)

Marks = tuple[tuple[float, str], ...]
"""Places on an axis and what is written there."""

WIDTH = 380.0
"""Of every picture, in units that the page scales to its column."""
_DIGITS = ((1, 2, 5), (1, 1.5, 2, 3, 4, 6, 8), tuple(digit / 10 for digit in range(10, 100)))
"""Of ticks on a logarithmic axis: coarse ones first, finer ones where less than a decade is shown."""
_MOST_MARKS = 9
"""Texts along an axis before they touch."""
_FINEST = 0.15  # of a picture unit: a straight line this near to a curve cannot be told from it
_LEFT, _RIGHT, _TOP, _BOTTOM = 54.0, 14.0, 8.0, 36.0
"""Room beside the frame for ticks and titles."""
SIDES, ENDS = _LEFT + _RIGHT, _TOP + _BOTTOM
"""What a picture is wider, and higher, than its frame."""


@dataclass(frozen=True)
class Axes:
    """A plot's two ranges and its size; the y axis points up.

    Parameters
    ----------
    x, y
        First and last value shown.
    x_title, y_title
        Quantity and unit.
    height
        Of the whole picture; its width is :data:`WIDTH` units, which the page scales to the column.
    x_marks, y_marks
        Places of ticks and their texts; round numbers where none are given.

    """

    x: tuple[float, float]
    y: tuple[float, float]
    x_title: str
    y_title: str
    height: float = 250.0
    x_marks: Marks = ()
    y_marks: Marks = ()

    def px(self, x: Number) -> Number:
        """Horizontal place of a value."""
        return _LEFT + (x - self.x[0]) / (self.x[1] - self.x[0]) * (WIDTH - _LEFT - _RIGHT)

    def py(self, y: Number) -> Number:
        """Vertical place of a value."""
        return self.height - _BOTTOM - (y - self.y[0]) / (self.y[1] - self.y[0]) * self._inner_height

    @property
    def _inner_height(self) -> float:
        return self.height - _TOP - _BOTTOM

    def svg(self, content: Sequence[Markup], label: str, *, css: str = "panel") -> Markup:
        """The whole picture: grid on a ``css`` ground, content cut off at the frame, ticks and titles."""
        parts = [self._grid(css), self._window(Markup("").join(content)), self._titles()]
        return Markup(
            '<svg class="plot" viewBox="0 0 {w:g} {h:g}" role="img" aria-label="{label}">{body}</svg>'
        ).format(w=WIDTH, h=self.height, label=label, body=Markup("").join(parts))

    def image(self, uri: str) -> Markup:
        """A picture stretched over the frame."""
        return Markup(
            '<image href="{uri}" x="{x:.1f}" y="{y:.1f}" width="{w:.1f}" height="{h:.1f}" '
            'preserveAspectRatio="none"/>'
        ).format(
            uri=uri,
            x=_LEFT,
            y=_TOP,
            w=WIDTH - _LEFT - _RIGHT,
            h=self._inner_height,
        )

    def line(self, points: Floats, css: str) -> Markup:
        """A curve through points (N, 2); a NaN row lifts the pen."""
        places = np.column_stack([self.px(points[:, 0]), self.py(points[:, 1])])
        known = np.asarray(np.isfinite(places).all(axis=1))
        starts = np.flatnonzero(known & ~np.append(False, known[:-1]))
        ends = np.flatnonzero(known & ~np.append(known[1:], False)) + 1
        pieces = (_stroke(places[start:end]) for start, end in zip(starts, ends, strict=True))
        return Markup('<path class="{}" d="{}"/>').format(css, "".join(pieces))

    def area(self, points: Floats, css: str) -> Markup:
        """A closed shape through points (N, 2)."""
        places = np.column_stack([self.px(points[:, 0]), self.py(points[:, 1])])
        return Markup('<path class="{}" d="{}Z"/>').format(css, _stroke(places))

    def box(self, x: tuple[float, float], y: tuple[float, float], css: str, *, pad: float = 0.0) -> Markup:
        """A rectangle between values, widened by ``pad`` units on every side."""
        left, right = sorted(map(self.px, x))
        top, bottom = sorted(map(self.py, y))
        return Markup(
            '<rect class="{css}" x="{x:.1f}" y="{y:.1f}" width="{w:.1f}" height="{h:.1f}"/>'
        ).format(css=css, x=left - pad, y=top - pad, w=right - left + 2 * pad, h=bottom - top + 2 * pad)

    def dot(self, x: float, y: float, css: str, radius: float = 4.0) -> Markup:
        """A disc at a value."""
        return Markup('<circle class="{css}" cx="{x:.1f}" cy="{y:.1f}" r="{r:g}"/>').format(
            css=css, x=self.px(x), y=self.py(y), r=radius
        )

    def text(self, x: float, y: float, text: str, css: str) -> Markup:
        """Words at a place in picture units."""
        return Markup('<text class="{css}" x="{x:.1f}" y="{y:.1f}">{text}</text>').format(
            css=css, x=x, y=y, text=text
        )

    def _window(self, content: Markup) -> Markup:
        """Content in the same coordinates, cut off at the frame."""
        place = Markup("{:.1f} {:.1f} {:.1f} {:.1f}").format(
            _LEFT, _TOP, WIDTH - _LEFT - _RIGHT, self._inner_height
        )
        x, y, width, height = place.split()
        return Markup(
            '<svg x="{}" y="{}" width="{}" height="{}" viewBox="{}" preserveAspectRatio="none">{}</svg>'
        ).format(x, y, width, height, place, content)

    def _grid(self, css: str) -> Markup:
        bottom, right = self.height - _BOTTOM, WIDTH - _RIGHT
        lines = [Markup('<g class="grid">'), self.box(self.x, self.y, css)]
        for tick, words in self.x_marks or _round_marks(self.x):
            lines.append(_segment(self.px(tick), _TOP, self.px(tick), bottom))
            lines.append(self.text(self.px(tick), bottom + 13, words, "tick x"))
        for tick, words in self.y_marks or _round_marks(self.y):
            lines.append(_segment(_LEFT, self.py(tick), right, self.py(tick)))
            lines.append(self.text(_LEFT - 5, self.py(tick) + 3.5, words, "tick y"))
        return Markup("").join([*lines, Markup("</g>")])

    def _titles(self) -> Markup:
        middle = self.height - _BOTTOM - self._inner_height / 2
        x_title = self.text((_LEFT + WIDTH - _RIGHT) / 2, self.height - 6, self.x_title, "title x")
        y_title = Markup('<text class="title x" transform="translate(10 {y:.1f}) rotate(-90)">{t}</text>')
        return x_title + y_title.format(y=middle, t=self.y_title)


def _stroke(places: Floats) -> str:
    """One unbroken piece of a curve as an SVG path, without the points that nobody can see."""
    kept = cv2.approxPolyDP(places.astype(np.float32)[:, None], _FINEST, closed=False)[:, 0]
    return "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in kept)


def _round_marks(ends: tuple[float, float]) -> Marks:
    return tuple((tick, _number(tick)) for tick in ticks(*ends))


def log_marks(low: float, high: float) -> Marks:
    """Round sizes on a common logarithmic axis from ``low`` to ``high``; 1, 2, 5 where these are enough."""
    powers = range(math.floor(low), math.ceil(high) + 1)
    marks: Marks = ()
    for digits in _DIGITS:
        sizes = [digit * 10.0**power for power in powers for digit in digits]
        marks = tuple((math.log10(size), f"{size:g}") for size in sizes if low <= math.log10(size) <= high)
        if len(marks) > 2:
            break
    return marks[:: math.ceil(len(marks) / _MOST_MARKS)]


def ticks(low: float, high: float, about: int = 5) -> list[float]:
    """Round values (1, 2 or 5 times a power of ten apart) within a range."""
    step = round_up((high - low) / about)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [index * step for index in range(first, last + 1)]


def round_up(value: float) -> float:
    """The next of 1, 2, 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= value * (1 - 1e-9))


def padded(values: Floats) -> tuple[float, float]:
    """The range of finite values, with some room on both sides."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    room = (high - low) * 0.06 or 1.0
    return low - room, high + room


def _segment(x0: float, y0: float, x1: float, y1: float) -> Markup:
    return Markup('<path d="M{:.1f} {:.1f}L{:.1f} {:.1f}"/>').format(x0, y0, x1, y1)


def _number(value: float) -> str:
    return f"{value:.10g}".replace("-", "−")
