"""Places on a wheel's surface: the (u, v) of its mesh, millimetres about a blemish's middle, and back.

u is the share of a turn, v that of the outline's length, as :func:`scenes.wheel.revolve.revolve` has them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from burrscan.arrays import Floats
from burrscan.errors import InputError
from burrscan.turns import turn_deg
from scenes.surface.cover import half_extent_mm
from scenes.surface.spec import Blemish, Chatter

_STEP_MM = 0.01
"""Between points of the walked outline: a hundredth of the smallest blemish that a camera here would see."""
_ON_AXIS_MM = 1e-3
"""Radius below which there is no circumference to lay a blemish along."""


class Chart:
    """The outline of a wheel, walked from its start; O(outline / 0.01 mm) memory."""

    def __init__(self, generatrix_zr_mm: Floats) -> None:
        lengths = np.linalg.norm(np.diff(generatrix_zr_mm, axis=0), axis=1)
        walked = np.concatenate([[0.0], np.cumsum(lengths)])
        self.length_mm = float(walked[-1])
        count = int(np.ceil(self.length_mm / _STEP_MM)) + 1
        self.walked_mm: Floats = np.union1d(np.linspace(0.0, self.length_mm, count), walked)
        self.zr_mm: Floats = np.stack(
            [np.interp(self.walked_mm, walked, generatrix_zr_mm[:, i]) for i in (0, 1)], axis=1
        )
        self._tree = cKDTree(self.zr_mm)

    def nearest_mm(self, zr_mm: Floats) -> Floats:
        """(N,) how far along the outline the nearest points to (N, 2) are, within 0.005 mm."""
        return np.asarray(self.walked_mm[self._tree.query(zr_mm)[1]])

    def outermost_zr(self, z_mm: float) -> Floats:
        """The outermost point at z.

        Raises
        ------
        InputError
            When the wheel does not reach there.

        """
        z, r = self.zr_mm.T
        if not z.min() <= z_mm <= z.max():
            raise InputError(f"z {z_mm:g} mm is not on the wheel ({z.min():g} to {z.max():g} mm)")
        near = np.abs(z - z_mm) <= _STEP_MM
        return np.array([z_mm, r[near].max()])


@dataclass(frozen=True)
class Place:
    """Where a blemish is: its middle, and a frame there in millimetres.

    Parameters
    ----------
    angle_deg, walked_mm, radius_mm
        Of the middle: atan2 angle, way along the outline, distance from the axis.
    half_mm
        Half of its extent along the circumference and along the outline.
    whole_turn
        Whether it runs all round.

    """

    angle_deg: float
    walked_mm: float
    radius_mm: float
    half_mm: tuple[float, float]
    whole_turn: bool

    def local_mm(self, angle_deg: Floats, walked_mm: Floats) -> tuple[Floats, Floats]:
        """X along the circumference and y along the outline of points, from the middle."""
        turns = turn_deg(angle_deg - self.angle_deg)
        return np.radians(turns) * self.radius_mm, walked_mm - self.walked_mm


class Extent(NamedTuple):
    """Of a blemish in the part frame."""

    arc_deg: float
    z_start_mm: float
    z_end_mm: float


def place_of(blemish: Blemish, chart: Chart) -> Place:
    """Where a blemish is on a wheel.

    Raises
    ------
    InputError
        When it is beyond the wheel's ends, or a band's ends are not in order.

    """
    if isinstance(blemish, Chatter):
        return _band(blemish, chart)
    zr = chart.outermost_zr(blemish.z_mm) if blemish.r_mm is None else np.array([blemish.z_mm, blemish.r_mm])
    walked = float(chart.nearest_mm(zr[None])[0])
    radius = float(np.interp(walked, chart.walked_mm, chart.zr_mm[:, 1]))
    if radius < _ON_AXIS_MM:
        raise InputError("a blemish cannot be on the axis")
    half = half_extent_mm(blemish)
    if 2.0 * half[0] > np.pi * radius:
        raise InputError(
            f"{2.0 * half[0]:.3g} mm along a circumference of radius {radius:.3g} mm is too much"
        )
    return Place(blemish.angle_deg, walked, radius, half, whole_turn=False)


def extent_of(place: Place, chart: Chart) -> Extent:
    """Angle and axial extent of a place, from the stretch of the outline that it covers."""
    ends = np.clip(
        [place.walked_mm - place.half_mm[1], place.walked_mm + place.half_mm[1]], 0.0, chart.length_mm
    )
    z = chart.zr_mm[(chart.walked_mm >= ends[0]) & (chart.walked_mm <= ends[1]), 0]
    arc = 360.0 if place.whole_turn else float(np.degrees(2.0 * place.half_mm[0] / place.radius_mm))
    return Extent(arc, float(z.min()), float(z.max()))


def _band(blemish: Chatter, chart: Chart) -> Place:
    if not blemish.z_start_mm < blemish.z_end_mm:
        raise InputError(f"z_start_mm {blemish.z_start_mm:g} must be less than z_end_mm {blemish.z_end_mm:g}")
    ends = [chart.nearest_mm(chart.outermost_zr(z)[None])[0] for z in (blemish.z_start_mm, blemish.z_end_mm)]
    middle = float(np.mean(ends))
    radius = float(np.interp(middle, chart.walked_mm, chart.zr_mm[:, 1]))
    whole = blemish.arc_deg == 360
    half_x = np.radians(blemish.arc_deg) / 2.0 * radius
    return Place(
        blemish.angle_deg, middle, radius, (float(half_x), float(abs(ends[1] - ends[0]) / 2.0)), whole
    )
