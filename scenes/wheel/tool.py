"""What every burr becomes before it meets the wheel: lofted solids and what is known of them exactly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from burrscan.arrays import Bools, Floats, freeze
from scenes.wheel.section import Section

SINK_MM = 0.2
"""How far a burr's root reaches into the wheel (a nick's tool out of it), so that the boolean is robust."""
OVERLAP_MM = 0.02
"""How far the flanks run on through the surface before they turn to the root."""

LONGEST_ONWARD = 0.25
"""At most this share of the flank's last stretch: where it is short or flat it is led through instead."""


@dataclass(frozen=True)
class Tool:
    """Solids to unite with the wheel or to cut from it: the pieces of one burr.

    Parameters
    ----------
    stations_mm
        (N, K + 2, 3) rings for :func:`scenes.wheel.loft.loft`: the K points of the section, its ends led on
        through the surface, then the two points of the root.
    smooth
        (K + 2,) whether the surface is smooth across that point of the ring.
    pieces
        (P, 2) first and last station of each piece.
    position_mm
        (N,) of each station along the burr.
    thickness_mm
        (N,) mean thickness: the section's area over its height.
    side
        ``protrusion`` is united, ``nick`` cut.
    angle_deg, z_start_mm, z_end_mm, width_mm, length_mm
        Of the burr, as in :class:`scenes.wheel.truth.TrueBurr`.
    arc_deg
        Angular extent.

    """

    stations_mm: Floats
    smooth: Bools
    pieces: tuple[tuple[int, int], ...]
    position_mm: Floats
    thickness_mm: Floats
    side: Literal["protrusion", "nick"]
    angle_deg: float
    z_start_mm: float
    z_end_mm: float
    width_mm: float
    length_mm: float
    arc_deg: float

    def __post_init__(self) -> None:
        freeze(self, stations_mm=self.stations_mm, smooth=self.smooth)
        freeze(self, position_mm=self.position_mm, thickness_mm=self.thickness_mm)

    @property
    def flanks_mm(self) -> Floats:
        """(N, K - 2, 3) the section's points off the surface: crest or bottom is one of them."""
        return self.stations_mm[:, 1:-3]

    @property
    def whole(self) -> Bools:
        """(N - 1,) whether there is material between each station and the next."""
        gaps = np.arange(len(self.stations_mm) - 1)
        return np.asarray(np.any([(gaps >= first) & (gaps < last) for first, last in self.pieces], axis=0))


def ring_smooth(section: Section) -> Bools:
    """(K + 2,) the smooth points of a ring: the section's; its root has edges."""
    return np.concatenate([section.smooth, [False, False]])


def mean_thickness_mm(section: Section) -> Floats:
    """(N,) the area of the section over its height."""
    return np.asarray(section.areas_mm2() / np.abs(section.points_mm[..., 1]).max(axis=1))


def piece_stations(positions_mm: Floats, pieces_mm: Floats) -> tuple[tuple[int, int], ...]:
    """First and last station of each piece, of stations that hold the pieces' ends."""
    ends = np.searchsorted(positions_mm, pieces_mm - 1e-9)
    return tuple((int(first), int(last)) for first, last in ends)
