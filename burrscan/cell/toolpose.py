"""Poses of the flange that bring the mill to a place: it is round, so the flange may be turned about it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from burrscan.arrays import Floats
from burrscan.cell.positioner import OutOfReachError
from burrscan.cell.station import Station, turned

_ROLLS_DEG = (0.0, 180.0, 30.0, -30.0, 60.0, -60.0, 90.0, -90.0)
"""Turns of the flange about the mill, tried in this order: the mill is round, the scanner need not touch.
The first two keep camera and projector in one plane along the burr."""


def _upright_roll(station: Station, T_base_tool: Floats) -> float:
    """The turn about the mill that has the camera highest above its own place in the mill's frame."""
    camera = np.linalg.inv(station.T_camera_tool)[:3, 3]
    wanted = T_base_tool[:3, :3].T @ np.array([0.0, 0.0, 1.0])
    if np.hypot(wanted[0], wanted[1]) < 1e-3:
        wanted = T_base_tool[:3, :3].T @ -T_base_tool[:3, 3]
    return float(np.degrees(np.arctan2(wanted[1], wanted[0]) - np.arctan2(camera[1], camera[0])))


def move_tool(
    station: Station, T_base_tool: Floats, *, rolls: Sequence[float] = (), slant_deg: float = 0.0
) -> tuple[Floats, float]:
    """Bring the tool there, at the first roll about itself that the arm can reach without touching.

    Those of ``rolls`` are tried in their order; without any all that there are, the upright ones first and
    turned by ``slant_deg`` more: rows of pixels that cross a burr at a slant sample its section as densely as
    there are rows (the slanted edge of ISO 12233), those along it at a few places only.

    Returns
    -------
    tuple
        (4, 4) ``T_base_camera`` as reported, and the roll.

    Raises
    ------
    OutOfReachError
        When the arm can stand there in no pose.

    """
    said = ""
    T_tool_flange = np.linalg.inv(station.T_flange_tool)
    if not rolls:
        upright = _upright_roll(station, T_base_tool) + slant_deg
        rolls = [upright + roll for roll in _ROLLS_DEG]
    for roll in rolls:
        try:
            reported = station.arm.move(turned(T_base_tool, roll) @ T_tool_flange)
        except OutOfReachError as error:
            said = said or str(error)
            continue
        return np.asarray(reported @ station.T_flange_camera), roll
    raise OutOfReachError(f"the mill can stand over the burr in no pose: {said}")
