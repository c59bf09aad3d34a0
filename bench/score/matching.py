"""Which burr found is which true burr."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from burrscan.turns import turn_deg

WITHIN_DEG = 3.0
"""A burr is found when one is reported within this angle of it (issue 2) and overlapping along the axis."""


@dataclass(frozen=True)
class Place:
    """Where a burr is in the true part frame, found or true.

    Parameters
    ----------
    side
        ``protrusion`` or ``nick``.
    angle_deg, arc_deg
        Angle of its middle, and half of the arc that it spans about it; 0 where it runs along the axis.
    z_start_mm, z_end_mm
        Extent along the axis, start below end; NaN where a method states none.
    height_mm
        Height or depth, positive.

    """

    side: str
    angle_deg: float
    arc_deg: float
    z_start_mm: float
    z_end_mm: float
    height_mm: float


@dataclass(frozen=True)
class Matching:
    """Burrs found against true burrs.

    Parameters
    ----------
    true, found
        Where they are.
    match
        Per burr found: the true burr it is, or -1 for a false call.
    best
        Per true burr: the burr found that tells its errors, or -1 where it was missed.
    located
        Per true burr: whether a burr of either side was found at its place.

    """

    true: tuple[Place, ...]
    found: tuple[Place, ...]
    match: tuple[int, ...]
    best: tuple[int, ...]
    located: tuple[bool, ...]


def match_places(true: Sequence[Place], found: Sequence[Place]) -> Matching:
    """Match burrs found with true ones by their places.

    A burr found belongs to the true burr of its own side that it overlaps along the axis and whose arc it is
    nearest to, within :data:`WITHIN_DEG`. Several pieces of one burr are one hit and no false call; the piece
    with the longest overlap, then the smallest angle error, tells the errors. O(true × found).
    """
    match = tuple(_owner(place, true) for place in found)
    best = tuple(_best_piece(number, place, found, match) for number, place in enumerate(true))
    located = tuple(any(_at(one, place) for one in found) for place in true)
    return Matching(tuple(true), tuple(found), match, best, located)


def overlap_mm(a: Place, b: Place) -> float:
    """Common extent along the axis; negative: the gap. All of the other where one states none."""
    return float(np.fmin(a.z_end_mm, b.z_end_mm) - np.fmax(a.z_start_mm, b.z_start_mm))


def _off_arc_deg(found: Place, true: Place) -> float:
    return max(abs(turn_deg(found.angle_deg - true.angle_deg)) - true.arc_deg, 0.0)


def _at(found: Place, true: Place) -> bool:
    return overlap_mm(found, true) > 0.0 and _off_arc_deg(found, true) <= WITHIN_DEG


def _owner(found: Place, true: Sequence[Place]) -> int:
    near = {
        number: _off_arc_deg(found, place)
        for number, place in enumerate(true)
        if place.side == found.side and _at(found, place)
    }
    return min(near, key=near.__getitem__, default=-1)


def _best_piece(number: int, true: Place, found: Sequence[Place], match: Sequence[int]) -> int:
    pieces = [piece for piece, owner in enumerate(match) if owner == number]
    return min(
        pieces,
        key=lambda piece: (
            -overlap_mm(found[piece], true),
            abs(turn_deg(found[piece].angle_deg - true.angle_deg)),
        ),
        default=-1,
    )
