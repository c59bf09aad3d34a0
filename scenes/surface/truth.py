"""What is known exactly of the blemishes of a wheel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Floats, Ints32
from burrscan.errors import InputError
from scenes.surface.chart import Chart, Place, extent_of, place_of
from scenes.surface.cover import cover_of
from scenes.surface.spec import Blemish

_HALF = 0.5
"""Cover from which a point is the blemish's: the middle of the rim."""


@dataclass(frozen=True)
class TrueBlemish:
    """A blemish as it is: no burr, whatever an algorithm calls it.

    Parameters
    ----------
    kind
        ``stain``, ``bright_spot``, ``scratch`` or ``chatter``.
    angle_deg, arc_deg
        atan2 angle of its middle, and its angular extent.
    z_start_mm, z_end_mm
        Extent along the axis.
    length_mm, width_mm
        Extent along the wheel's outline, and along the circumference.

    """

    kind: str
    angle_deg: float
    arc_deg: float
    z_start_mm: float
    z_end_mm: float
    length_mm: float
    width_mm: float


def placed_blemishes(blemishes: Sequence[Blemish], chart: Chart) -> list[Place]:
    """Where blemishes are.

    Raises
    ------
    InputError
        When one is not on the wheel, with its number.

    """
    places = []
    for index, blemish in enumerate(blemishes):
        try:
            places.append(place_of(blemish, chart))
        except InputError as error:
            raise InputError(f"blemish {index}: {blemish.kind}: {error}") from error
    return places


def true_blemishes(blemishes: Sequence[Blemish], generatrix_zr_mm: Floats) -> tuple[TrueBlemish, ...]:
    """The truth of a wheel's blemishes.

    Raises
    ------
    InputError
        When one is not on the wheel.

    """
    if not blemishes:
        return ()
    chart = Chart(generatrix_zr_mm)
    return tuple(
        _true(blemish, place, chart)
        for blemish, place in zip(blemishes, placed_blemishes(blemishes, chart), strict=True)
    )


def blemish_at(points_mm: Floats, blemishes: Sequence[Blemish], generatrix_zr_mm: Floats) -> Ints32:
    """(N,) index of the blemish that covers each surface point to more than half, -1 for none; the last wins.

    Parameters
    ----------
    points_mm
        (N, 3) surface points of the wheel itself (not of its burrs) in the part frame.
    blemishes, generatrix_zr_mm
        Of the scene and its wheel.

    """
    owner = np.full(len(points_mm), -1, np.int32)
    if not blemishes or not len(points_mm):
        return owner
    chart = Chart(generatrix_zr_mm)
    zr = np.stack([points_mm[:, 2], np.hypot(points_mm[:, 0], points_mm[:, 1])], axis=1)
    angle = np.degrees(np.arctan2(points_mm[:, 1], points_mm[:, 0]))
    walked = chart.nearest_mm(zr)
    for index, (blemish, place) in enumerate(zip(blemishes, placed_blemishes(blemishes, chart), strict=True)):
        x, y = place.local_mm(angle, walked)
        owner[cover_of(blemish, x, y, place.half_mm) > _HALF] = index
    return owner


def _true(blemish: Blemish, place: Place, chart: Chart) -> TrueBlemish:
    extent = extent_of(place, chart)
    return TrueBlemish(
        kind=blemish.kind,
        angle_deg=place.angle_deg,
        arc_deg=extent.arc_deg,
        z_start_mm=extent.z_start_mm,
        z_end_mm=extent.z_end_mm,
        length_mm=2.0 * place.half_mm[1],
        width_mm=2.0 * place.half_mm[0],
    )
