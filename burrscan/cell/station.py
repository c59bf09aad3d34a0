"""What a cell is made of, as its software is told it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from burrscan.arrays import Floats, freeze
from burrscan.cell.positioner import Positioner
from burrscan.scanner import Scanner


class Spindle(Protocol):
    """What turns the mill."""

    def start(self) -> None:
        """From now on the mill cuts."""

    def stop(self) -> None:
        """It cuts no longer."""


@dataclass(frozen=True)
class Station:
    """A scanner and a tool on an arm's flange, in front of a turntable.

    Parameters
    ----------
    arm, table
        The two positioners.
    scanner
        On the arm's flange: a capture is made from wherever it has been moved.
    T_flange_camera
        (4, 4) camera to flange coordinates (``burrscan calibrate --hand-eye``).
    T_camera_tool
        (4, 4) the tool in the camera's frame: origin in the middle of the mill's end, z away from the part.
    T_base_plate
        (4, 4) the plate of the table when it is not turned, its z upwards along its axis.
    standoff_mm
        Working distance of the scanner, along the camera's axis.
    middle_mm
        (3,) about where the part's middle is, in the frame of the plate: from a drawing, or a rule.
    spindle
        Of the mill; None where nothing is to be removed.

    """

    arm: Positioner
    table: Positioner
    scanner: Scanner
    T_flange_camera: Floats
    T_camera_tool: Floats
    T_base_plate: Floats
    standoff_mm: float
    middle_mm: Floats
    spindle: Spindle | None = None

    def __post_init__(self) -> None:
        freeze(self, T_flange_camera=self.T_flange_camera, T_camera_tool=self.T_camera_tool)
        freeze(self, T_base_plate=self.T_base_plate, middle_mm=self.middle_mm)

    @property
    def T_flange_tool(self) -> Floats:  # noqa: N802 (T_target_source)
        """(4, 4) the tool on the flange."""
        return np.asarray(self.T_flange_camera @ self.T_camera_tool)

    @property
    def lever_mm(self) -> float:
        """From the flange to the tool: the flange's turns act over it."""
        return float(np.linalg.norm(self.T_flange_tool[:3, 3]))

    @property
    def plunge_mm(self) -> float:
        """Standard deviation of the tool's place along its axis from one move of the arm to the next."""
        tool = self.T_flange_tool
        beside = float(np.linalg.norm(np.cross(tool[:3, 2], tool[:3, 3])))
        return float(np.hypot(self.arm.sheet.scatter_mm, np.radians(self.arm.sheet.scatter_deg) * beside))

    @property
    def lens_sigma(self) -> tuple[float, float]:
        """Standard deviation (mm, deg) about each axis of a reported pose of the camera over the plate."""
        arm, table = self.arm.sheet, self.table.sheet
        mm = np.hypot(np.hypot(arm.offset_mm, arm.scatter_mm), np.hypot(table.offset_mm, table.scatter_mm))
        deg = np.hypot(
            np.hypot(arm.offset_deg, arm.scatter_deg), np.hypot(table.offset_deg, table.scatter_deg)
        )
        return float(mm), float(deg)


@dataclass(frozen=True)
class Stand:
    """Where to look from.

    Parameters
    ----------
    turn_deg
        Of the table.
    T_base_camera
        (4, 4) of the camera.

    """

    turn_deg: float
    T_base_camera: Floats

    def __post_init__(self) -> None:
        freeze(self, T_base_camera=self.T_base_camera)


def turned(pose: Floats, turn_deg: float) -> Floats:
    """(4, 4) a pose turned about its own z: the plate's, or the mill's."""
    turn = np.eye(4)
    angle = np.radians(turn_deg)
    turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return np.asarray(pose @ turn)


def go(station: Station, stand: Stand) -> Floats:
    """Turn the table, move the arm, and say where the camera is over the plate: (4, 4) ``T_plate_camera``.

    Raises
    ------
    burrscan.cell.positioner.OutOfReachError
        When one of the two cannot go there.

    """
    plate = station.table.move(turned(station.T_base_plate, stand.turn_deg))
    flange = station.arm.move(stand.T_base_camera @ np.linalg.inv(station.T_flange_camera))
    return np.asarray(np.linalg.inv(plate) @ flange @ station.T_flange_camera)
