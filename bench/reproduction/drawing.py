"""What the paper's figures need beyond the report's charts: views of points, heat maps, many lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from bench.plotting import pictures
from bench.plotting.axes import ENDS, SIDES, WIDTH, Axes, log_marks, padded
from bench.plotting.pictures import picture
from burrscan.arrays import Bools, Floats, Levels

INK, GREEN = "#5f6b7a", "#0a8f4d"
"""Of a mesh, and of its sections."""
SHOWN = 15_000
"""Points of a mesh drawn: a picture's worth."""
RASTER = 640
"""Width in pixels of points drawn as a picture."""
_LEVELS = 40
"""Colours of a heat map: steps too small to see, and a picture that packs well."""
_HEAT = ((13, 32, 77), (28, 99, 140), (62, 159, 142), (160, 205, 110), (250, 235, 140))
"""From the least to the largest, even steps in lightness."""


@dataclass(frozen=True)
class Layer:
    """Points of one colour, ``#rrggbb``, each ``size`` pixels wide."""

    points: Floats
    colour: str
    size: int = 1


def equal_axes(points: Floats, x_title: str, y_title: str) -> Axes:
    """Axes around points (N, 2) with one scale for both directions."""
    known = points[np.isfinite(points).all(axis=1)]
    low, high = known.min(axis=0), known.max(axis=0)
    room = 0.04 * float((high - low).max())
    low, high = low - room, high + room
    inner = (WIDTH - SIDES) * float((high[1] - low[1]) / (high[0] - low[0]))
    height = min(max(inner, 90.0), 420.0)
    extra = (height / inner - 1.0) / 2.0
    if extra > 0.0:
        grow = extra * float(high[1] - low[1])
        low[1], high[1] = low[1] - grow, high[1] + grow
    else:
        grow = (inner / height - 1.0) / 2.0 * float(high[0] - low[0])
        low[0], high[0] = low[0] - grow, high[0] + grow
    return Axes(
        (float(low[0]), float(high[0])), (float(low[1]), float(high[1])), x_title, y_title, height + ENDS
    )


def bulk(points: Floats, *, share: float = 0.005) -> Floats:
    """Two corners around nearly all points (N, 2): strays are left out of a picture's frame."""
    return np.quantile(points, [share, 1.0 - share], axis=0)


def dots(axes: Axes, layers: Sequence[Layer]) -> Markup:
    """Many points as one picture, later layers on top."""
    height = round(RASTER * (axes.height - ENDS) / (WIDTH - SIDES))
    labels = np.zeros((height, RASTER), np.uint8)
    for number, layer in enumerate(layers, 1):
        _mark(labels, axes, layer, number)
    return axes.image(pictures.classes(labels, {n: layer.colour for n, layer in enumerate(layers, 1)}))


def _mark(labels: Levels, axes: Axes, layer: Layer, number: int) -> None:
    height, width = labels.shape
    x = (layer.points[:, 0] - axes.x[0]) / (axes.x[1] - axes.x[0]) * width
    y = (axes.y[1] - layer.points[:, 1]) / (axes.y[1] - axes.y[0]) * height
    for right in range(layer.size):
        for down in range(layer.size):
            column, row = np.floor(x).astype(int) + right, np.floor(y).astype(int) + down
            inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
            labels[row[inside], column[inside]] = number


def heat(axes: Axes, values: Floats, limits: tuple[float, float]) -> Markup:
    """Values (rows from the bottom, columns) in colours from dark to light; NaN is left out."""
    share = np.clip((values - limits[0]) / max(limits[1] - limits[0], 1e-300), 0.0, 1.0)
    labels = np.where(np.isfinite(values), 1 + np.round(np.nan_to_num(share) * (_LEVELS - 1)), 0)
    return axes.image(pictures.classes(labels[::-1].astype(np.uint8), _heat_colours()))


def _heat_colours() -> Mapping[int, str]:
    colours = pictures.ramp(_HEAT, _LEVELS)
    return {number: "#{:02x}{:02x}{:02x}".format(*colour) for number, colour in enumerate(colours, 1)}


def heat_gradient() -> str:
    """The colours of :func:`heat` as a CSS gradient."""
    return pictures.gradient(_HEAT)


def chart(
    curves: Mapping[str, Floats],
    x_title: str,
    y_title: str,
    label: str,
    *,
    marks: bool = True,
    y: tuple[float, float] | None = None,
    height: float = 240.0,
    log: tuple[bool, bool] = (False, False),
) -> Markup:
    """Curves (N, 2) by style class, their points marked; axes are logarithmic where ``log`` says so."""
    logs = np.array(log)
    curves = {css: np.where(logs, np.log10(np.where(logs, c, 1.0)), c) for css, c in curves.items()}
    every = np.concatenate(list(curves.values()))
    ends = padded(every[:, 0]), y or padded(every[:, 1])
    marks_of = [log_marks(*end) if is_log else () for end, is_log in zip(ends, log, strict=True)]
    axes = Axes(*ends, x_title, y_title, height, *marks_of)
    parts = [axes.line(curve, f"curve {css}") for css, curve in curves.items()]
    if marks:
        parts += [spot(axes, row, f"dot {css}", 3.0) for css, c in curves.items() for row in c[known_rows(c)]]
    return axes.svg(parts, label)


def spot(axes: Axes, point: Floats, css: str, radius: float) -> Markup:
    """A disc at a point (2,)."""
    return axes.dot(float(point[0]), float(point[1]), css, radius)


def known_rows(points: Floats) -> Bools:
    """Which rows hold numbers."""
    return np.asarray(np.isfinite(points).all(axis=1))


def grey(image: Levels, label: str) -> Markup:
    """A grey picture."""
    return picture(pictures.photo(image), label)


def ring(centre: Floats, radius: float) -> Floats:
    """(N, 2) a circle's points."""
    t = np.linspace(0.0, 2.0 * np.pi, 120)
    return np.asarray(centre + radius * np.column_stack([np.cos(t), np.sin(t)]))
