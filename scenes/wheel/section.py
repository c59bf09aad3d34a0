"""Cross-sections of burrs: closed outlines over their base, in the plane across the burr.

x runs across the burr along the surface, y is the height above it, mm. Every outline runs from the base's end
at -x over the crest to the end at +x, and its largest y is the height.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Bools, Floats, freeze
from burrscan.errors import InputError
from scenes.wheel.course import Course
from scenes.wheel.spec import AxialRidge, RimBurr, tip_thickness_mm

_ROUND = 24
"""Segments of a parabola: their chords are within 1/576 of the height."""
_QUARTER = 10
"""Segments of a quarter of the curl, 9° each."""
_TIP = 8
"""Segments of the half circle at the tip."""
_CURL_SHARE = 0.3
"""Radius of the curl's middle line over the height: rise, quarter turn and tip have room below it."""
_CURL_PER_THICKNESS = 0.6
"""The same radius over the thickness: above 0.5, or the strip's inner side would fold over itself."""
_THICKEST_CURL = 0.5
"""Thickness over height, above which no strip is left to curl."""
_WIDEST_CURL = 1.5
"""Base over height: a wider base would fill the space under the curl."""


@dataclass(frozen=True)
class Section:
    """Outlines along a burr.

    Parameters
    ----------
    points_mm
        (N, K, 2) x and y per station.
    smooth
        (K,) whether the surface is smooth across that point; False at edges.

    """

    points_mm: Floats
    smooth: Bools

    def __post_init__(self) -> None:
        freeze(self, points_mm=self.points_mm, smooth=self.smooth)

    def areas_mm2(self) -> Floats:
        """(N,) area of each outline over its base."""
        x, y = self.points_mm[..., 0], self.points_mm[..., 1]
        ahead_x, ahead_y = np.roll(x, -1, axis=1), np.roll(y, -1, axis=1)
        return np.asarray(0.5 * np.sum(ahead_x * y - x * ahead_y, axis=1))

    def reversed(self) -> Section:
        """The same outline walked from +x to -x."""
        return Section(self.points_mm[:, ::-1], self.smooth[::-1])


def section_of(burr: AxialRidge | RimBurr, course: Course) -> Section:
    """The cross-sections of a burr along its course.

    Raises
    ------
    InputError
        When a rolled burr is too thick to be rolled.

    """
    points, edges = _SHAPES[burr.section](burr, course)
    sheared = points[..., 0] + points[..., 1] * np.tan(np.radians(course.leans_deg))[:, None]
    smooth = np.full(points.shape[1], True)
    smooth[[0, *edges, -1]] = False
    return Section(np.stack([sheared, points[..., 1]], axis=-1), smooth)


def prism(half_width_mm: float, depths_mm: Floats) -> Section:
    """A plain triangle of one width, upright: a nick's."""
    half = np.full_like(depths_mm, half_width_mm)
    return Section(_joined((-half, 0.0), (0.0, depths_mm), (half, 0.0)), np.full(3, False))


def _triangle(_: AxialRidge | RimBurr, course: Course) -> tuple[Floats, tuple[int, ...]]:
    half = course.widths_mm / 2.0
    return _joined((-half, 0.0), (0.0, course.heights_mm), (half, 0.0)), (1,)


def _rounded(_: AxialRidge | RimBurr, course: Course) -> tuple[Floats, tuple[int, ...]]:
    """A parabola: two thirds of the area of its box."""
    share = np.linspace(-1.0, 1.0, _ROUND + 1)
    x = course.widths_mm[:, None] / 2.0 * share
    return np.stack([x, course.heights_mm[:, None] * (1.0 - share**2)], axis=-1), ()


def _flake(_: AxialRidge | RimBurr, course: Course) -> tuple[Floats, tuple[int, ...]]:
    """A trapezoid; its crest is the middle of the tip."""
    half, tip, height = course.widths_mm / 2.0, course.tips_mm / 2.0, course.heights_mm
    return _joined((-half, 0.0), (-tip, height), (0.0, height), (tip, height), (half, 0.0)), (1, 3)


def _rolled(burr: AxialRidge | RimBurr, course: Course) -> tuple[Floats, tuple[int, ...]]:
    """A strip that rises, tapering to the tip's thickness, and curls over about a centre beside it.

    The curl's middle line has a radius of 0.3 of the height (0.6 of a thick tip); the tip is round. Its
    base is nowhere wider than 1.5, its tip nowhere thicker than 0.5 of its height there.
    """
    height = course.heights_mm[:, None]
    _check_curl(burr)
    thickness = np.minimum(course.tips_mm[:, None], _THICKEST_CURL * height)
    radius = np.maximum(_CURL_SHARE * height, _CURL_PER_THICKNESS * thickness)
    rise = height - radius - thickness / 2.0
    end = abs(burr.curl_deg)
    over = max(2, round(_QUARTER * (end - 90.0) / 90.0))
    turn = np.radians(
        np.concatenate([np.linspace(0.0, 90.0, _QUARTER + 1), np.linspace(90.0, end, over + 1)[1:]])
    )
    outer = _about(radius, rise, radius + thickness / 2.0, turn)
    inner = _about(radius, rise, radius - thickness / 2.0, turn[::-1])
    tip = _about_tip(radius, rise, thickness / 2.0, turn[-1])
    half = np.minimum(course.widths_mm, _WIDEST_CURL * course.heights_mm) / 2.0
    base = _joined((-half, 0.0), (half, 0.0))
    points = np.concatenate([base[:, :1], outer, tip, inner, base[:, 1:]], axis=1)
    mirrored = points[:, ::-1] * np.array([-1.0, 1.0]) if burr.curl_deg < 0.0 else points
    return mirrored, (1, points.shape[1] - 2)


def _check_curl(burr: AxialRidge | RimBurr) -> None:
    tip_mm, most_mm = tip_thickness_mm(burr), _THICKEST_CURL * burr.height_mm
    if tip_mm > most_mm * (1.0 + 1e-9):
        raise InputError(
            f"{burr.kind}: with a tip of {tip_mm:g} mm nothing {burr.height_mm:g} mm high can be rolled; "
            f"at most {most_mm:g} mm"
        )


def _about(centre_x: Floats, centre_y: Floats, radius: Floats, turn: Floats) -> Floats:
    """(N, T, 2) an arc about (centre_x, centre_y), from -x upwards."""
    return np.stack([centre_x - radius * np.cos(turn), centre_y + radius * np.sin(turn)], axis=-1)


def _about_tip(radius: Floats, rise: Floats, half: Floats, turn: float) -> Floats:
    """(N, 5, 2) the half circle that ends the strip, its ends left to the strip's sides."""
    around = np.linspace(0.0, np.pi, _TIP + 1)[1:-1]
    # outwards is (-cos, sin), onwards (sin, cos)
    x = (
        radius
        - radius * np.cos(turn)
        + half * (-np.cos(turn) * np.cos(around) + np.sin(turn) * np.sin(around))
    )
    y = rise + radius * np.sin(turn) + half * (np.sin(turn) * np.cos(around) + np.cos(turn) * np.sin(around))
    return np.stack([x, y], axis=-1)


def _joined(*points: tuple[Floats | float, Floats | float]) -> Floats:
    columns = [np.stack(np.broadcast_arrays(x, y), axis=-1) for x, y in points]
    size = max(len(c) for c in columns if c.ndim > 1)
    return np.stack([np.broadcast_to(c, (size, 2)) for c in columns], axis=1)


_SHAPES: dict[str, Callable[[AxialRidge | RimBurr, Course], tuple[Floats, tuple[int, ...]]]] = {
    "triangle": _triangle,
    "rounded": _rounded,
    "rolled": _rolled,
    "flake": _flake,
}
