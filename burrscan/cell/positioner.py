"""The second port: whatever moves the scanner, the part or the tool to a pose.

A robot arm, a turntable and the simulated ones in ``scenes.cell`` stand behind the same protocol. Beside
:class:`burrscan.scanner.Scanner` it is all that a cell needs: everything else here is a loop over the two.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from burrscan.arrays import Floats
from burrscan.errors import InputError

SPHERE_MEAN, SPHERE_SPREAD = np.sqrt(8.0 / np.pi), np.sqrt(3.0 - 8.0 / np.pi)
"""Mean and standard deviation of the length of a vector of three standard normal components (Maxwell)."""
REPEATABILITY_SIGMAS = float(SPHERE_MEAN + 3.0 * SPHERE_SPREAD)
"""ISO 9283 states the repeatability RP of a position as the mean distance from the middle of the attained
positions plus three of its standard deviations: so many standard deviations along each axis, 3.62."""
ANGLE_SIGMAS = 3.0
"""And that of an angle as three standard deviations (ISO 9283, 7.2.2)."""


class OutOfReachError(InputError):
    """A pose that a positioner cannot or must not take; the message says which and why."""


@dataclass(frozen=True)
class PositionerSheet:
    """What a maker states of a positioner (ISO 9283).

    Parameters
    ----------
    reach_mm
        Farthest distance of the flange from the origin of the base frame.
    repeatability_mm, repeatability_deg
        RP: how far poses attained for one command scatter.
    accuracy_mm, accuracy_deg
        AP: distance of the middle of the attained poses from the command, root mean square over the
        workspace. It is nearly the same for commands near to each other.
    speed_mm_s, speed_deg_s
        Of a move; they make up what a look costs.

    """

    reach_mm: float
    repeatability_mm: float = 0.05
    repeatability_deg: float = 0.01
    accuracy_mm: float = 0.5
    accuracy_deg: float = 0.2
    speed_mm_s: float = 250.0
    speed_deg_s: float = 45.0

    @property
    def scatter_mm(self) -> float:
        """Standard deviation along each axis of poses attained for one command."""
        return self.repeatability_mm / REPEATABILITY_SIGMAS

    @property
    def scatter_deg(self) -> float:
        """Standard deviation about each axis of poses attained for one command."""
        return self.repeatability_deg / ANGLE_SIGMAS

    @property
    def offset_mm(self) -> float:
        """Standard deviation along each axis of where their middle is."""
        return float(self.accuracy_mm / np.sqrt(3.0))

    @property
    def offset_deg(self) -> float:
        """Standard deviation about each axis of where their middle is."""
        return float(self.accuracy_deg / np.sqrt(3.0))


class Positioner(Protocol):
    """Something with a flange that can be sent to poses."""

    @property
    def sheet(self) -> PositionerSheet:
        """The data sheet."""

    def move(self, T_base_flange: Floats) -> Floats:
        """Go to a pose, (4, 4) flange to base coordinates, mm, and say where the flange is by its encoders.

        Raises
        ------
        OutOfReachError
            When the pose is outside the workspace, or something would collide. Nothing has moved then.

        """


def seconds(sheet: PositionerSheet, T_from: Floats, T_to: Floats) -> float:
    """Time of a move between two poses of the flange: the slower of travelling and turning."""
    step = np.linalg.inv(T_from) @ T_to
    cosine = np.clip((np.trace(step[:3, :3]) - 1.0) / 2.0, -1.0, 1.0)
    way_mm = float(np.linalg.norm(step[:3, 3]))
    return max(way_mm / sheet.speed_mm_s, float(np.degrees(np.arccos(cosine))) / sheet.speed_deg_s)
