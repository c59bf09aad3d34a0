"""Bringing the mill to a burr by looking: the arm's word is wrong by tenths of a millimetre, a look is not.

The scanner and the mill sit on one flange, so a look sees the burr where the mill will be: what it measures
is the error itself, whatever the arm, the table and whoever bumped into the part have done. The arm need only
make small moves well, which it does: its error of accuracy is nearly the same for poses near to each other
(Hutchinson, Hager & Corke, A tutorial on visual servo control, 1996: position-based, look-then-move).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from burrscan.arrays import Floats, freeze
from burrscan.cell.positioner import OutOfReachError
from burrscan.cell.station import Station, turned
from burrscan.cell.toolpath import lift
from burrscan.cell.track import tracked
from burrscan.errors import InputError
from burrscan.inspection import Burr
from burrscan.pipeline import Outcome, Pipeline, run

HEIGHTS_MM = (30.0, 15.0, 8.0, 8.0)
"""Of the mill over the surface in each look: it comes in steps, and at the last ones it is near."""
_GATE_MM = (6.0, 2.0)
"""How far from where it is expected the burr may be, in the first look and in later ones: a part that was
moved by 2 mm and 1 degree, 100 mm from its middle, and an arm that is off by half a millimetre, are within
the first."""
_SQUARE_DEG = 0.5
"""The mill stands upright within this: over its radius of 2 mm it is 0.017 mm."""
_OTHER_WAY_DEG = 40.0
"""Turn about the mill for the next look where one did not find the burr: its flank answers from there."""
_ROLLS_DEG = (0.0, 30.0, -30.0, 60.0, -60.0, 90.0, -90.0, 180.0)
"""Turns of the flange about the mill, tried in this order: the mill is round, the scanner need not touch."""


@dataclass(frozen=True)
class Glance:
    """One look of the servo.

    Parameters
    ----------
    T_base_camera
        (4, 4) the camera, as reported.
    height_mm
        Of the mill over the surface, as it was asked for.
    T_tool_burr
        (4, 4) the burr in the mill's frame, as measured; None where it was not found.
    off_mm
        How far the mill was from where it should have been: across the burr, and along its normal.
    tilt_deg
        And its axis from the burr's normal.
    outcome
        Of this look.
    why
        What the pipeline said where it found no surface of revolution.

    """

    T_base_camera: Floats
    height_mm: float
    T_tool_burr: Floats | None
    off_mm: tuple[float, float]
    tilt_deg: float
    outcome: Outcome | None = None
    why: str = ""

    @property
    def off(self) -> float:
        """The larger of the two distances, mm."""
        return max(map(abs, self.off_mm))

    def __post_init__(self) -> None:
        freeze(self, T_base_camera=self.T_base_camera, T_tool_burr=self.T_tool_burr)


@dataclass(frozen=True)
class Servoed:
    """How it ended.

    Parameters
    ----------
    converged
        Whether mill and burr agree within the tolerance. Where not, ``why`` says what happened; the mill
        must not go on then.
    glances
        Every look.
    burr
        The burr as the last look measured it, its pose in the frame of that look's camera.
    roll_deg
        Turn of the flange about the mill.

    """

    converged: bool
    why: str
    glances: tuple[Glance, ...]
    burr: Burr | None
    roll_deg: float = 0.0


def servo(
    station: Station,
    burr: Burr,
    T_plate_burr: Floats,
    *,
    tolerance_mm: float = 0.05,
    most: int = 4,
    pipeline: Pipeline | None = None,
) -> Servoed:
    """Bring the mill over a burr, square to the surface.

    Parameters
    ----------
    station
        The cell.
    burr
        As it was found, for its side and size.
    T_plate_burr
        (4, 4) where it was over the plate when it was found.
    tolerance_mm
        Mill and burr agree when the mill is no farther than this from its place across the burr, and along
        the burr's normal. Along the burr it need not be: there the path has an overrun.
    most
        Looks at most.
    pipeline
        Of the looks.

    Raises
    ------
    OutOfReachError
        When no pose is left in which the mill could stand there.

    """
    turn = facing_turn(station, T_plate_burr)
    plate = station.table.move(turned(station.T_base_plate, turn))
    expected = plate @ T_plate_burr
    glances: list[Glance] = []
    roll: float | None = None
    for _ in range(most):
        before = [glance for glance in glances if glance.T_tool_burr is not None]
        height = HEIGHTS_MM[min(len(before), len(HEIGHTS_MM) - 1)]
        reported, roll = _move(station, lift(expected, height), roll)
        found, glance = _glance(
            station, reported, burr, expected, height, pipeline, gate=_GATE_MM[bool(before)]
        )
        glances.append(glance)
        if found is None:
            roll += _OTHER_WAY_DEG if len(glances) % 2 else -2.0 * _OTHER_WAY_DEG
            continue
        expected = (
            _followed(expected, reported @ found.T_mesh_burr) if before else reported @ found.T_mesh_burr
        )
        if glance.off <= tolerance_mm and glance.tilt_deg <= _SQUARE_DEG:
            return Servoed(True, "", tuple(glances), found, roll)
    return Servoed(False, _why(glances, burr, tolerance_mm), tuple(glances), None)


def _why(glances: list[Glance], burr: Burr, tolerance_mm: float) -> str:
    last = glances[-1]
    if last.T_tool_burr is None:
        return last.why or f"look {len(glances)} finds no {burr.side} near its place"
    return f"{len(glances)} looks leave {last.off:.3f} mm, more than {tolerance_mm:g}"


def facing_turn(station: Station, T_plate_burr: Floats) -> float:
    """The turn of the table that brings the burr to the arm's side, degrees."""
    from_arm = -station.T_base_plate[:3, 3] @ station.T_base_plate[:3, :2]
    arm = np.degrees(np.arctan2(from_arm[1], from_arm[0]))
    normal = T_plate_burr[:2, 2]
    at = normal if np.linalg.norm(normal) > 0.5 else T_plate_burr[:2, 3]
    return float(arm - np.degrees(np.arctan2(at[1], at[0])))


def tool_poses(station: Station, T_base_tool: Floats) -> Iterator[tuple[float, Floats]]:
    """Turns about the mill's axis and poses of the flange that put the mill there, the upright ones first."""
    T_tool_flange = np.linalg.inv(station.T_flange_camera @ station.T_camera_tool)
    upright = _upright_roll(station, T_base_tool)
    for roll in _ROLLS_DEG:
        yield upright + roll, at_roll(T_base_tool, upright + roll) @ T_tool_flange


def at_roll(T_base_tool: Floats, roll_deg: float) -> Floats:
    """(4, 4) a tool pose turned about its own z."""
    turn = np.eye(4)
    turn[:3, :3] = Rotation.from_euler("z", roll_deg, degrees=True).as_matrix()
    return np.asarray(T_base_tool @ turn)


def _upright_roll(station: Station, T_base_tool: Floats) -> float:
    """The turn about the mill that has the camera highest above its own place in the mill's frame."""
    camera = np.linalg.inv(station.T_camera_tool)[:3, 3]
    wanted = T_base_tool[:3, :3].T @ np.array([0.0, 0.0, 1.0])
    if np.hypot(wanted[0], wanted[1]) < 1e-3:
        wanted = T_base_tool[:3, :3].T @ -T_base_tool[:3, 3]
    return float(np.degrees(np.arctan2(wanted[1], wanted[0]) - np.arctan2(camera[1], camera[0])))


def _move(station: Station, T_base_tool: Floats, roll: float | None) -> tuple[Floats, float]:
    """Bring the tool there, at the roll it has if it has one: (4, 4) ``T_base_camera`` reported, and roll."""
    said = ""
    T_tool_flange = np.linalg.inv(station.T_flange_camera @ station.T_camera_tool)
    tries = (
        tool_poses(station, T_base_tool)
        if roll is None
        else iter([(roll, at_roll(T_base_tool, roll) @ T_tool_flange)])
    )
    for angle, flange in tries:
        try:
            reported = station.arm.move(flange)
        except OutOfReachError as error:
            said = said or str(error)
            continue
        return np.asarray(reported @ station.T_flange_camera), angle
    raise OutOfReachError(f"the mill can stand over the burr in no pose: {said}")


def _glance(
    station: Station,
    reported: Floats,
    burr: Burr,
    expected: Floats,
    height_mm: float,
    pipeline: Pipeline | None,
    *,
    gate: float,
) -> tuple[Burr | None, Glance]:
    """Look, find the burr, and say where the mill is over it."""
    try:
        outcome = run(station.scanner, pipeline or Pipeline())
    except InputError as error:
        return None, Glance(reported, height_mm, None, (np.nan, np.nan), np.nan, why=str(error))
    at = np.asarray(np.linalg.inv(reported) @ expected, float)
    found = tracked(outcome, burr, at, gate_mm=gate)
    if found is None:
        return None, Glance(reported, height_mm, None, (np.nan, np.nan), np.nan, outcome)
    T_tool_burr = np.linalg.inv(station.T_camera_tool) @ found.T_mesh_burr
    # the mill's place over the burr, in the burr's own axes
    place = np.linalg.inv(T_tool_burr)
    tilt = float(np.degrees(np.arccos(np.clip(place[2, 2], -1.0, 1.0))))
    off = (float(place[1, 3]), float(place[2, 3] - height_mm))
    return found, Glance(reported, height_mm, np.asarray(T_tool_burr, float), off, tilt, outcome)


def _followed(expected: Floats, measured: Floats) -> Floats:
    """Where the burr is expected now: as measured, but along its length half way only.

    Its place across and along the normal is what a look measures well. Its middle along its length moves
    with what was seen of its ends.
    """
    step = np.linalg.inv(measured) @ expected
    kept = np.eye(4)
    kept[0, 3] = 0.5 * step[0, 3]
    return np.asarray(measured @ kept)
