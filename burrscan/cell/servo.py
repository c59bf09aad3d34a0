"""Bringing the mill to a burr by looking: the arm's word is wrong by tenths of a millimetre, a look is not.

The scanner and the mill sit on one flange, so a look sees the burr where the mill will be: what it measures
is the error itself, whatever the arm, the table and whoever bumped into the part have done. The arm need only
make small moves well, which it does: its error of accuracy is nearly the same for poses near to each other
(Hutchinson, Hager & Corke, A tutorial on visual servo control, 1996: position-based, look-then-move).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.special import ndtr

from burrscan.arrays import Floats, freeze
from burrscan.cell.look import of_several
from burrscan.cell.positioner import OutOfReachError
from burrscan.cell.sightings import Sighting, place_now, place_to_go
from burrscan.cell.station import Station, turned
from burrscan.cell.toolpath import lift
from burrscan.cell.track import Tracked, tracked
from burrscan.errors import InputError
from burrscan.inspection import Burr
from burrscan.pipeline import Outcome, Pipeline, run

HEIGHTS_MM = (20.0, 10.0, 8.0, 8.0)
"""Of the mill over the surface in each look: it comes in steps, and at the last ones it is near."""
_GATE_MM = (6.0, 2.0)
"""How far from where it is expected the burr may be, in the first look and in later ones: a part that was
moved by 2 mm and 1 degree, 100 mm from its middle, and an arm that is off by half a millimetre, are within
the first."""
_LEAST_LOOKS = 2
"""A look does not see what all its points err by; two from different poses do."""
_SURE = 0.7
"""Probability of being within the tolerance from which it is not worth another move, which may take the mill
out of it again: where a look knows the place to 0.025 to 0.045 mm and a move scatters by as much, as many
stop within 0.05 mm in four looks as with any other (``bench.experiments.servo_bound``)."""
_SQUARE_DEG = 0.5
"""The mill stands upright within this: over its radius of 2 mm it is 0.017 mm."""
_ROLLS_DEG = (0.0, 180.0, 30.0, -30.0, 60.0, -60.0, 90.0, -90.0)
"""Turns of the flange about the mill, tried in this order: the mill is round, the scanner need not touch.
The first two keep camera and projector in one plane along the burr."""


@dataclass(frozen=True)
class Glance:
    """One look of the servo.

    Parameters
    ----------
    T_base_camera
        (4, 4) the camera, as reported.
    height_mm
        Of the mill over the surface, as it was asked for.
    T_base_burr
        (4, 4) the burr as this look measured it; None where it was not found.
    off_mm
        How far the mill was from where it should be, by this look and those before it from the same side:
        across the burr, and along its normal.
    off_sigma_mm
        Standard deviation of the former.
    tilt_deg
        And its axis from the burr's normal.
    outcome
        Of this look.
    why
        What the pipeline said where it found no surface of revolution.

    """

    T_base_camera: Floats
    height_mm: float
    T_base_burr: Floats | None = None
    off_mm: tuple[float, float] = (np.nan, np.nan)
    off_sigma_mm: float = np.nan
    tilt_deg: float = np.nan
    outcome: Outcome | None = None
    why: str = ""

    def sure(self, tolerance_mm: float) -> float:
        """Probability that the mill is within the tolerance across the burr; 0 if it is too high or leans."""
        if not (abs(self.off_mm[1]) <= tolerance_mm and self.tilt_deg <= _SQUARE_DEG):
            return 0.0
        ends = (np.array([-tolerance_mm, tolerance_mm]) - self.off_mm[0]) / self.off_sigma_mm
        return float(np.diff(ndtr(ends))[0])

    def __post_init__(self) -> None:
        freeze(self, T_base_camera=self.T_base_camera, T_base_burr=self.T_base_burr)


class Finding(NamedTuple):
    """What a look says of a burr that is known to be there.

    Parameters
    ----------
    tracked
        Where it is; None where the look does not find it.
    outcome
        Of the look.
    why
        What the pipeline said where it found no surface of revolution.

    """

    tracked: Tracked | None
    outcome: Outcome | None = None
    why: str = ""


Finder = Callable[[Floats, float], Finding]
"""Looks from where the arm stands: given (4, 4) where the burr is expected in the camera's frame, and how far
from there it may be, mm."""


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
        The burr where all looks from the last side have it, its pose in the frame of the last one's camera:
        where moves from here on are best sent to, which scatter as those did.
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
    sure: float = _SURE,
    pipeline: Pipeline | None = None,
    find: Finder | None = None,
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
        Mill and burr agree when the mill is no farther than this from its place along the burr's normal and,
        with a probability of ``sure`` by two looks or more, across the burr. Along the burr it need not be:
        there the path has an overrun.
    most
        Looks at most.
    sure
        At which probability to stop.
    pipeline
        Of the looks.
    find
        What finds the burr in a look; by default a scan, and what :mod:`burrscan.cell.track` makes of it.

    Raises
    ------
    OutOfReachError
        When no pose is left in which the mill could stand there.

    """
    turn = facing_turn(station, T_plate_burr)
    plate = station.table.move(turned(station.T_base_plate, turn))
    expected = plate @ T_plate_burr
    pixel_mm = station.standoff_mm / station.scanner.rig.camera.fx
    lever = station.lever_mm
    slant = float(np.degrees(np.arctan2(pixel_mm, burr.length_mm.value)))
    find = find or _scanning(station, burr, pipeline)
    glances: list[Glance] = []
    same_side: list[Sighting] = []
    rolls: tuple[float, ...] = ()
    for _ in range(most):
        found = sum(glance.T_base_burr is not None for glance in glances)
        height = HEIGHTS_MM[min(found, len(HEIGHTS_MM) - 1)]
        reported, roll = move_tool(station, lift(expected, height), rolls=rolls, slant_deg=slant)
        seen, outcome, why = find(np.asarray(np.linalg.inv(reported) @ expected, float), _GATE_MM[found > 0])
        if seen is None:
            glances.append(Glance(reported, height, outcome=outcome, why=why))
            same_side = []
            rolls = roll + 180.0, roll  # from its other end, if the arm can
            continue
        rolls = (roll,)
        measured = np.asarray(reported @ seen.burr.T_mesh_burr, float)
        same_side.append(Sighting(measured, reported @ station.T_camera_tool, seen.across_sigma_mm))
        place, sigma = place_now(same_side, sheet=station.arm.sheet, lever_mm=lever)
        off, tilt = _off(station, reported, place, height)
        glances.append(Glance(reported, height, measured, off, sigma, tilt, outcome))
        expected = place_to_go(same_side, sheet=station.arm.sheet, lever_mm=lever)
        if len(same_side) >= _LEAST_LOOKS and glances[-1].sure(tolerance_mm) >= sure:
            here = np.asarray(np.linalg.inv(reported) @ expected, float)
            return Servoed(True, "", tuple(glances), replace(seen.burr, T_mesh_burr=here), roll)
    return Servoed(False, _why(glances, burr, tolerance_mm, sure), tuple(glances), None)


def _why(glances: list[Glance], burr: Burr, tolerance_mm: float, sure: float) -> str:
    last = glances[-1]
    if last.T_base_burr is None:
        return last.why or f"look {len(glances)} finds no {burr.side} near its place"
    across, normal = map(abs, last.off_mm)
    if last.tilt_deg > _SQUARE_DEG:
        return f"{len(glances)} looks leave the mill {last.tilt_deg:.1f} degrees from upright"
    return (
        f"{len(glances)} looks leave {across:.3f} ± {last.off_sigma_mm:.3f} mm across the burr and "
        f"{normal:.3f} mm along its normal; wanted was to be within {tolerance_mm:g}, {sure:.0%} sure"
    )


def facing_turn(station: Station, T_plate_burr: Floats) -> float:
    """The turn of the table that brings the burr to the arm's side, degrees."""
    from_arm = -station.T_base_plate[:3, 3] @ station.T_base_plate[:3, :2]
    arm = np.degrees(np.arctan2(from_arm[1], from_arm[0]))
    normal = T_plate_burr[:2, 2]
    at = normal if np.linalg.norm(normal) > 0.5 else T_plate_burr[:2, 3]
    return float(arm - np.degrees(np.arctan2(at[1], at[0])))


def tool_poses(
    station: Station, T_base_tool: Floats, *, slant_deg: float = 0.0
) -> Iterator[tuple[float, Floats]]:
    """Turns about the mill's axis and poses of the flange that put the mill there, the upright ones first.

    All are turned by ``slant_deg`` more: rows of pixels that cross a burr at a slant sample its section as
    densely as there are rows (the slanted edge of ISO 12233), those along it at a few places only.
    """
    T_tool_flange = np.linalg.inv(station.T_flange_tool)
    upright = _upright_roll(station, T_base_tool) + slant_deg
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


def move_tool(
    station: Station, T_base_tool: Floats, *, rolls: Sequence[float] = (), slant_deg: float = 0.0
) -> tuple[Floats, float]:
    """Bring the tool there, at the first roll about itself that the arm can reach without touching.

    Those of ``rolls`` are tried in their order; without any all that there are (:func:`tool_poses`).

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
    tries = (
        ((roll, at_roll(T_base_tool, roll) @ T_tool_flange) for roll in rolls)
        if rolls
        else tool_poses(station, T_base_tool, slant_deg=slant_deg)
    )
    for angle, flange in tries:
        try:
            reported = station.arm.move(flange)
        except OutOfReachError as error:
            said = said or str(error)
            continue
        return np.asarray(reported @ station.T_flange_camera), angle
    raise OutOfReachError(f"the mill can stand over the burr in no pose: {said}")


def _scanning(station: Station, burr: Burr, pipeline: Pipeline | None) -> Finder:
    """What the scanner sees, or why there is no surface of revolution in it."""
    rig = station.scanner.rig
    pixel_mm = station.standoff_mm / rig.camera.fx

    def find(T_camera_burr: Floats, gate_mm: float) -> Finding:
        try:
            outcome = run(station.scanner, of_several(pipeline))
        except InputError as error:
            return Finding(None, None, str(error))
        seen = tracked(outcome, burr, T_camera_burr, rig=rig, gate_mm=gate_mm, pixel_mm=pixel_mm)
        return Finding(seen, outcome)

    return find


def _off(
    station: Station, reported: Floats, T_base_burr: Floats, height_mm: float
) -> tuple[tuple[float, float], float]:
    """How far the mill is from its place over the burr, across and along the normal; and its tilt, deg."""
    T_burr_tool = np.linalg.inv(T_base_burr) @ reported @ station.T_camera_tool
    tilt = float(np.degrees(np.arccos(np.clip(T_burr_tool[2, 2], -1.0, 1.0))))
    return (float(T_burr_tool[1, 3]), float(T_burr_tool[2, 3] - height_mm)), tilt
