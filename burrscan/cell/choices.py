"""Where the scanner may stand: a few poses of the arm, each with every turn of the table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Floats
from burrscan.cell.chart import AROUND, Chart
from burrscan.cell.outlook import Outlook, leaning
from burrscan.cell.station import Stand, Station
from burrscan.pose import placed
from burrscan.rig import Rig

ELEVATIONS_DEG = (32.0, 10.0, 55.0)
"""Of the camera above the table, the first look's first: it sees the side and the upper face."""
ROLLS_DEG = (90.0, 0.0)
"""Of the camera about its axis: a flank may mirror the part inside one epipolar plane, not inside both. With
the baseline along the axis both flanks of an axial burr are measured alike; it comes first."""
POSTURES_DEG = tuple((elevation, roll) for roll in ROLLS_DEG for elevation in ELEVATIONS_DEG)
"""Elevation and roll of every pose of the arm, in the order of their numbers."""
TURN_DEG = 15.0
"""Between turns of the table: five cells of the chart."""
FLANK_DEG = 50.0
"""Lean of a burr's flanks from the surface: half way from lying to upright, and a little more."""


@dataclass(frozen=True)
class Arm:
    """One pose of the arm, and what it shows while the table is not turned."""

    T_base_camera: Floats
    surface: Outlook
    flanks: tuple[Outlook, Outlook]


@dataclass(frozen=True)
class Choice:
    """One pose of the arm (its number) and one turn of the table."""

    arm: int
    turn_deg: float

    @property
    def cells(self) -> int:
        """By how many cells of the chart the table turns the part."""
        return round(self.turn_deg * AROUND / 360.0)


def arm_poses(station: Station) -> tuple[Floats, ...]:
    """(4, 4) poses of the camera that face the part's middle from the arm's side."""
    middle = placed(station.T_base_plate, station.middle_mm)
    # the arm's shoulder is the base's origin: the part is seen from there
    towards = np.arctan2(middle[1], middle[0])
    return tuple(
        _facing(middle, towards, elevation, roll, station.standoff_mm) for elevation, roll in POSTURES_DEG
    )


def all_choices(poses: Sequence[Floats]) -> tuple[Choice, ...]:
    """Every pose of the arm with every turn of the table, the first look's pose first."""
    turns = np.arange(0.0, 360.0, TURN_DEG)
    return tuple(Choice(arm, float(turn)) for arm in range(len(poses)) for turn in turns)


def stand_of(choice: Choice, poses: Sequence[Floats]) -> Stand:
    """The stand that a choice means."""
    return Stand(choice.turn_deg, poses[choice.arm])


def outlooks(
    chart: Chart,
    rig: Rig,
    station: Station,
    poses: Sequence[Floats],
    T_plate_part: Floats,
) -> tuple[Arm, ...]:
    """What each pose of the arm shows of the part as it stands. O(poses × cells × S)."""
    T_base_part = station.T_base_plate @ T_plate_part
    arms = []
    for pose in poses:
        T_camera_part = np.linalg.inv(pose) @ T_base_part
        leans = 0.0, -FLANK_DEG, FLANK_DEG
        surface, *flanks = leaning(chart, rig, T_camera_part, chart.angles, leans_deg=leans)
        arms.append(Arm(pose, surface, (flanks[0], flanks[1])))
    return tuple(arms)


def _facing(middle: Floats, towards: float, elevation_deg: float, roll_deg: float, away_mm: float) -> Floats:
    elevation, roll = np.radians(elevation_deg), np.radians(roll_deg)
    forward = np.array(
        [np.cos(elevation) * np.cos(towards), np.cos(elevation) * np.sin(towards), -np.sin(elevation)]
    )
    level = np.array([np.sin(towards), -np.cos(towards), 0.0])
    down = np.cross(forward, level)
    right = np.cos(roll) * level + np.sin(roll) * down
    transform = np.eye(4)
    transform[:3, :3] = np.stack([right, np.cross(forward, right), forward], axis=1)
    transform[:3, 3] = middle - away_mm * forward
    return transform
