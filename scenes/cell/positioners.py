"""The simulated arm and turntable: they go nearly where they are sent, and say that they are there."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from burrscan.arrays import Floats
from burrscan.cell.positioner import OutOfReachError, PositionerSheet
from scenes.cell.errors import AttainedPoses

_ITS_OWN_MM = 1e-3
"""A turntable's commands may be off its axis by rounding."""


class SimulatedArm:
    """A :class:`burrscan.cell.positioner.Positioner` that carries something; it starts at ``T_home``.

    Parameters
    ----------
    sheet, attained
        What it states, and where it goes.
    T_home
        (4, 4) its first pose.
    refuse
        Raises OutOfReachError for a pose at which something would collide.
    moved
        Called after each move.

    """

    def __init__(
        self,
        sheet: PositionerSheet,
        attained: AttainedPoses,
        *,
        T_home: Floats,
        refuse: Callable[[Floats], None],
        moved: Callable[[], None],
    ) -> None:
        self._sheet, self._attained, self._refuse, self._moved = sheet, attained, refuse, moved
        self.T_true = T_home

    @property
    def sheet(self) -> PositionerSheet:
        """The data sheet."""
        return self._sheet

    def move(self, T_base_flange: Floats) -> Floats:
        """Go there; the encoders know of no error of the links, so they report the command."""
        away = float(np.linalg.norm(T_base_flange[:3, 3]))
        if away > self._sheet.reach_mm:
            raise OutOfReachError(
                f"the arm reaches {self._sheet.reach_mm:.0f} mm, the pose is {away:.0f} mm from its shoulder"
            )
        self._refuse(T_base_flange)
        self.T_true = self._attained.attained(T_base_flange)
        self._moved()
        return T_base_flange


class SimulatedTable:
    """A turntable: its flange is its plate, which turns about its own z and goes nowhere else."""

    def __init__(self, sheet: PositionerSheet, attained: AttainedPoses, *, T_home: Floats) -> None:
        self._sheet, self._attained, self._home = sheet, attained, T_home
        self.T_true = T_home

    @property
    def sheet(self) -> PositionerSheet:
        """The data sheet."""
        return self._sheet

    def move(self, T_base_flange: Floats) -> Floats:
        """Turn the plate."""
        turn = np.linalg.inv(self._home) @ T_base_flange
        off = np.abs(turn[:3, 3]).max() + np.abs(turn[:3, 2] - [0.0, 0.0, 1.0]).max()
        if off > _ITS_OWN_MM:
            raise OutOfReachError("a turntable turns about its own axis; it goes to no other pose")
        self.T_true = self._attained.attained(T_base_flange)
        return T_base_flange
