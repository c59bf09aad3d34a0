"""What a turn of the table does for a burr: bring it to the arm's side, and move it across under the mill."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from burrscan.arrays import Floats
from burrscan.cell.positioner import PositionerSheet
from burrscan.cell.station import Station

_LEAST_MM = 1.0
"""A burr that is nearer to the table's axis than this is turned, not moved."""
_ACROSS = 0.5
"""Least share of the way across the burr's line; along it the mill need not be exact."""


class Turn(NamedTuple):
    """A turn of the table.

    Parameters
    ----------
    deg
        By how much.
    sigma_mm
        How well the burr is moved by it.

    """

    deg: float
    sigma_mm: float


def facing_turn(station: Station, T_plate_burr: Floats) -> float:
    """The turn of the table that brings the burr to the arm's side, degrees."""
    from_arm = -station.T_base_plate[:3, 3] @ station.T_base_plate[:3, :2]
    arm = np.degrees(np.arctan2(from_arm[1], from_arm[0]))
    normal = T_plate_burr[:2, 2]
    at = normal if np.linalg.norm(normal) > 0.5 else T_plate_burr[:2, 3]
    return float(arm - np.degrees(np.arctan2(at[1], at[0])))


def turn_across(
    T_base_plate: Floats, T_base_burr: Floats, across_mm: float, *, sheet: PositionerSheet
) -> Turn | None:
    """The turn of the table that moves a burr by so much across its line.

    A table's small turn is more exact than an arm's small move by an order of magnitude, for it acts over the
    part's radius and an arm's over its own length; and the arm, which scatters in each move, stays.

    Parameters
    ----------
    T_base_plate
        (4, 4) the plate as it stands; it turns about its z.
    T_base_burr
        (4, 4) the burr: x along it, z out of the part.
    across_mm
        Wanted way along its y.
    sheet
        Of the table.

    Returns
    -------
    Turn or None
        None where the burr lies so that turning moves it along its line, or not at all.

    """
    arm = T_base_burr[:3, 3] - T_base_plate[:3, 3]
    per_rad = T_base_burr[:3, :3].T @ np.cross(T_base_plate[:3, 2], arm)
    way = float(np.linalg.norm(per_rad))
    if way < _LEAST_MM or abs(per_rad[1]) < _ACROSS * way:
        return None
    # its error of accuracy is the same before and after so small a turn, but no sheet says how nearly
    mm = np.hypot(sheet.scatter_mm, sheet.offset_mm)
    deg = np.hypot(sheet.scatter_deg, sheet.offset_deg)
    return Turn(float(np.degrees(across_mm / per_rad[1])), float(np.hypot(mm, np.radians(deg) * way)))
