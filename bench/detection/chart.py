"""The chart of detection curves: one self-contained SVG, for the report and for people."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from bench.detection.curve import PodCurve
from bench.detection.records import Detection
from burrscan.arrays import Floats

WIDTH, HEIGHT = 560.0, 360.0
"""Of the picture, in units that the page scales."""
COLOURS = ("#8a5a00", "#1f6f8b", "#7a3e9d", "#3f8f5f")
_LEFT, _RIGHT, _TOP, _BOTTOM = 52.0, 16.0, 14.0, 46.0
"""Room beside the frame for ticks and titles."""
_LINE = 15.0
"""Height of a line of the legend."""
_ROUND = (1.0, 2.0, 5.0)
"""Digits of ticks on a logarithmic axis."""


def chart(found: Sequence[Detection], *, title: str = "Probability of detection") -> Markup:
    """Curves with their bands, shares found with exact bounds, a90 and a90/95, false calls in the legend.

    Parameters
    ----------
    found
        Up to four, such as the two arms of a comparison; the same size on all of them.
    title
        For those who hear pictures.

    Returns
    -------
    markupsafe.Markup
        An ``<svg>`` element that needs no style sheet; text takes the page's colour and font.

    """
    sizes = [share.size for item in found for share in item.shares if share.size > 0.0]
    if not sizes:
        return Markup("")
    low, high = math.log(min(sizes)) - 0.2, math.log(max(sizes)) + 0.2
    frame = _Frame(low, high)
    legend = HEIGHT + _LINE * (2 * len(found))
    parts = [frame.grid(found[0].size_name)]
    for item, colour in zip(found, COLOURS, strict=False):
        parts += [frame.curve(item.curve, colour) if item.curve else Markup(""), frame.dots(item, colour)]
    for number, (item, colour) in enumerate(zip(found, COLOURS, strict=False)):
        parts.append(_legend(item, colour, HEIGHT + 2 * _LINE * number + 4))
    return Markup(
        '<svg class="pod" xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {w:g} {h:g}" role="img" '
        'aria-label="{label}" font-family="sans-serif" font-size="11" fill="currentColor">{body}</svg>'
    ).format(w=WIDTH, h=legend + 6, label=title, body=Markup("").join(parts))


class _Frame:
    """Axes: log size to the right, POD upwards."""

    def __init__(self, low: float, high: float) -> None:
        self.low, self.high = low, high

    def px(self, size: float) -> float:
        x = math.log(size) if size > 0.0 else -math.inf
        return _LEFT + min(max((x - self.low) / (self.high - self.low), 0.0), 1.0) * (WIDTH - _LEFT - _RIGHT)

    def py(self, pod: float) -> float:
        return HEIGHT - _BOTTOM - pod * (HEIGHT - _TOP - _BOTTOM)

    def inside(self, size: float) -> bool:
        return size > 0.0 and self.low <= math.log(size) <= self.high

    def grid(self, size_name: str) -> Markup:
        lines = [
            _line(_LEFT, self.py(p), WIDTH - _RIGHT, self.py(p), 0.9) for p in (0.0, 0.25, 0.5, 0.75, 0.9, 1)
        ]
        lines += [_text(_LEFT - 6, self.py(p) + 4, f"{p:g}", "end") for p in (0.0, 0.25, 0.5, 0.75, 0.9, 1)]
        for size in self._ticks():
            lines += [
                _line(self.px(size), _TOP, self.px(size), HEIGHT - _BOTTOM, 0.92),
                _text(self.px(size), HEIGHT - _BOTTOM + 15, f"{size:g}", "middle"),
            ]
        name, _, unit = size_name.rpartition("_")
        words = f"burr {name.replace('_', ' ')}, {unit}" if name else size_name
        lines.append(_text((_LEFT + WIDTH - _RIGHT) / 2, HEIGHT - 12, words, "middle"))
        return Markup("").join(lines)

    def _ticks(self) -> list[float]:
        powers = range(math.floor(self.low / math.log(10.0)), math.ceil(self.high / math.log(10.0)) + 1)
        ticks = [digit * 10.0**power for power in powers for digit in _ROUND]
        return [tick for tick in ticks if self.inside(tick)]

    def curve(self, fit: PodCurve, colour: str) -> Markup:
        """Band, curve, and marks at a90 and a90/95."""
        kept = np.array([self.inside(size) for size in fit.size])
        size = fit.size[kept]
        ring = [*zip(size, fit.low[kept], strict=True), *zip(size[::-1], fit.high[kept][::-1], strict=True)]
        marks = [
            Markup('<circle cx="{:.1f}" cy="{:.1f}" r="4" fill="{}" stroke="{}"/>').format(
                self.px(a), self.py(0.9), fill, colour
            )
            for a, fill in ((fit.a90, colour), (fit.a90_95, "#fff"))
            if self.inside(a)
        ]
        band = Markup('<path d="{}Z" fill="{}" opacity="0.15"/>').format(self._path(np.array(ring)), colour)
        line = Markup('<path d="{}" fill="none" stroke="{}" stroke-width="2"/>').format(
            self._path(np.column_stack([size, fit.pod[kept]])), colour
        )
        return Markup("").join([band, line, *marks])

    def dots(self, item: Detection, colour: str) -> Markup:
        """Shares found, with their exact bounds."""
        drawn = []
        for share in item.shares:
            if share.size > 0.0:
                x = self.px(share.size)
                drawn.append(
                    Markup('<path d="M{x:.1f} {a:.1f}V{b:.1f}" stroke="{c}" opacity="0.6"/>').format(
                        x=x, a=self.py(share.low), b=self.py(share.high), c=colour
                    )
                )
                drawn.append(
                    Markup('<rect x="{x:.1f}" y="{y:.1f}" width="5" height="5" fill="{c}"/>').format(
                        x=x - 2.5, y=self.py(share.hits / share.trials) - 2.5, c=colour
                    )
                )
        return Markup("").join(drawn)

    def _path(self, points: Floats) -> str:
        return "M" + "L".join(f"{self.px(float(a)):.1f} {self.py(float(p)):.1f}" for a, p in points)


def _legend(item: Detection, colour: str, top: float) -> Markup:
    """Two lines: the name with its false calls, then the sizes detected."""
    calls = f"{item.false_calls_per_wheel:.2g} false calls per wheel"
    low, high = item.false_calls_interval
    head = f"{item.name}: {calls} ({low:.2g} to {high:.2g}; {item.wheels} wheels)"
    box = Markup('<rect x="{x:g}" y="{y:.1f}" width="10" height="10" fill="{c}"/>').format(
        x=_LEFT, y=top, c=colour
    )
    return (
        box
        + _text(_LEFT + 16, top + 9, head, "start")
        + _text(_LEFT + 16, top + 9 + _LINE, sizes_told(item), "start")
    )


def sizes_told(item: Detection) -> str:
    """The sizes detected, in words."""
    if item.curve is None:
        return item.why_not
    fit = item.curve
    told = [f"{name} {fit.told(value)}" for name, value in (("a50", fit.a50), ("a90", fit.a90))]
    bound = "not shown by these burrs" if math.isinf(fit.a90_95) else fit.told(fit.a90_95)
    return ", ".join([*told, f"a90/95 {bound}", f"{fit.hits} of {fit.trials} found"])


def _line(x0: float, y0: float, x1: float, y1: float, lightness: float) -> Markup:
    grey = round(255 * lightness)
    return Markup('<path d="M{:.1f} {:.1f}L{:.1f} {:.1f}" stroke="rgb({g},{g},{g})"/>').format(
        x0, y0, x1, y1, g=grey
    )


def _text(x: float, y: float, words: str, anchor: str) -> Markup:
    return Markup('<text x="{:.1f}" y="{:.1f}" text-anchor="{}">{}</text>').format(x, y, anchor, words)
