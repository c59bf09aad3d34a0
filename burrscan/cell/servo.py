"""Bringing the mill to a burr by looking: the arm's word is wrong by tenths of a millimetre, a look is not.

The scanner and the mill sit on one flange, so a look sees the burr where the mill will be: what it measures
is the error itself, whatever the arm, the table and whoever bumped into the part have done. The arm need only
make small moves well, which it does: its error of accuracy is nearly the same for poses near to each other
(Hutchinson, Hager & Corke, A tutorial on visual servo control, 1996: position-based, look-then-move). But it
scatters in each move, by about what is wanted; so once the mill stands upright at its height the arm stays,
and what is left across the burr the table turns away, which acts over the part's radius only.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from burrscan.arrays import Floats, freeze
from burrscan.cell.look import of_several
from burrscan.cell.sightings import Sighting, place_now, place_to_go
from burrscan.cell.station import Station, turned
from burrscan.cell.toolpath import lift
from burrscan.cell.toolpose import move_tool
from burrscan.cell.track import Tracked, tracked
from burrscan.cell.turning import facing_turn, turn_across
from burrscan.errors import InputError
from burrscan.inspection import Burr, Inspection
from burrscan.pipeline import Outcome, Pipeline, run

HEIGHTS_MM = (20.0, 10.0, 8.0, 8.0)
"""Of the mill over the surface in each look: it comes in steps, and at the last ones it is near."""
_GATE_MM = (6.0, 2.0)
"""How far from where it is expected the burr may be, in the first look and in later ones: a part that was
moved by 2 mm and 1 degree, 100 mm from its middle, and an arm that is off by half a millimetre, are within
the first."""
_LEAST_LOOKS = 2
"""A look does not see what all its points err by; two from different poses do."""
_SURE = 0.6
"""Probability of being within the tolerance that is asked for in the end. Another look does not move the arm,
so that what is left then is what looks know: with 0.7 fewer runs stop, and of those no more are within
(``bench.experiments.servo_bound``)."""
_SURE_SOON = 0.95
"""And from which no look that is left is made, where the arm need not move for it."""
_SQUARE_DEG = 0.5
"""The mill stands upright within this: over its radius of 2 mm it is 0.017 mm."""


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
        How far the mill is from where it should be, by this look and those before it from the same side, the
        table turned after it: across the burr, and along its normal.
    off_sigma_mm
        Standard deviation of the former.
    tilt_deg
        And its axis from the burr's normal.
    turned_deg
        By how much the table was turned after the look, for what it saw.
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
    turned_deg: float = 0.0
    outcome: Outcome | None = None
    why: str = ""

    def upright(self, tolerance_mm: float) -> bool:
        """Whether the mill stands at its height, and upright."""
        return abs(self.off_mm[1]) <= tolerance_mm and self.tilt_deg <= _SQUARE_DEG

    def sure(self, tolerance_mm: float) -> float:
        """Probability that the mill is within the tolerance across the burr; 0 if it is too high or leans."""
        if not self.upright(tolerance_mm):
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


class Arrived(NamedTuple):
    """The burr, where its mesh is, and the last look with what it shows: see :class:`Servoed`."""

    burr: Burr
    T_base_mesh: Floats
    last: Glance
    inspection: Inspection


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
        The burr where all looks from the last side have it, its pose in the frame of the last one's mesh:
        where moves from here on are best sent to, which scatter as those did.
    T_base_mesh
        (4, 4) where the last look's mesh is now that the table was turned.
    turn_deg
        Of the table.

    """

    converged: bool
    why: str
    glances: tuple[Glance, ...]
    burr: Burr | None
    T_base_mesh: Floats | None = None
    turn_deg: float = 0.0

    def __post_init__(self) -> None:
        freeze(self, T_base_mesh=self.T_base_mesh)

    def arrived(self) -> Arrived:
        """What there is once the mill is over the burr.

        Raises
        ------
        InputError
            When it is not.

        """
        last = self.glances[-1] if self.glances else None
        if self.burr is None or self.T_base_mesh is None or last is None or last.outcome is None:
            raise InputError(f"the mill is not over the burr: {self.why}")
        return Arrived(self.burr, self.T_base_mesh, last, last.outcome.inspection)


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
        Least probability with which to say that it converged. Looks that the arm need not move for are made
        until it is 0.95.
    pipeline
        Of the looks.
    find
        What finds the burr in a look; by default a scan, and what :mod:`burrscan.cell.track` makes of it.

    Raises
    ------
    OutOfReachError
        When no pose is left in which the mill could stand there.

    """
    table = _Table(station, facing_turn(station, T_plate_burr))
    expected = table.T_base_plate @ T_plate_burr
    pixel_mm = station.standoff_mm / station.scanner.rig.camera.fx
    lever = station.lever_mm
    slant = float(np.degrees(np.arctan2(pixel_mm, burr.length_mm.value)))
    find = find or _scanning(station, burr, pipeline)
    glances: list[Glance] = []
    same_side: list[Sighting] = []
    rolls: tuple[float, ...] = ()
    moves, stay = 0, False
    reported, roll, height = np.eye(4), 0.0, HEIGHTS_MM[0]
    for _ in range(most):
        found = sum(glance.T_base_burr is not None for glance in glances)
        if not stay:
            moves, height = moves + 1, HEIGHTS_MM[min(found, len(HEIGHTS_MM) - 1)]
            reported, roll = move_tool(station, lift(expected, height), rolls=rolls, slant_deg=slant)
        seen, outcome, why = find(np.asarray(np.linalg.inv(reported) @ expected, float), _GATE_MM[found > 0])
        if seen is None:
            glances.append(Glance(reported, height, outcome=outcome, why=why))
            same_side, stay = [], False
            rolls = roll + 180.0, roll  # from its other end, if the arm can
            continue
        rolls = (roll,)
        measured = np.asarray(reported @ seen.burr.T_mesh_burr, float)
        flange = np.asarray(reported @ np.linalg.inv(station.T_flange_camera), float)
        same_side.append(Sighting(measured, flange, seen.across_sigma_mm, moves))
        place, sigma = place_now(same_side, sheet=station.arm.sheet, lever_mm=lever)
        off, tilt = _off(station, reported, place, height)
        glance = Glance(reported, height, measured, off, sigma, tilt, outcome=outcome)
        swing, glance, stay = table.put_across(glance, place, tolerance_mm=tolerance_mm)
        glances.append(glance)
        same_side = [one._replace(T_base_burr=swing @ one.T_base_burr) for one in same_side]
        expected = place_to_go(same_side, sheet=station.arm.sheet, lever_mm=lever)
        enough = max(sure, _SURE_SOON) if stay and len(glances) < most else sure
        if len(same_side) >= _LEAST_LOOKS and glance.sure(tolerance_mm) >= enough:
            T_base_mesh = np.asarray(swing @ reported, float)
            here = np.asarray(np.linalg.inv(T_base_mesh) @ expected, float)
            return Servoed(
                True, "", tuple(glances), replace(seen.burr, T_mesh_burr=here), T_base_mesh, table.turn_deg
            )
    return Servoed(False, _why(glances, burr, tolerance_mm, sure), tuple(glances), None)


class _Table:
    """The table as it stands, and what its small turns do."""

    def __init__(self, station: Station, turn_deg: float) -> None:
        self._station, self.turn_deg = station, turn_deg
        self.T_base_plate = station.table.move(turned(station.T_base_plate, turn_deg))

    def put_across(
        self, glance: Glance, T_base_burr: Floats, *, tolerance_mm: float
    ) -> tuple[Floats, Glance, bool]:
        """Turn away what a glance has left across the burr, where the arm can stay for the rest.

        Returns
        -------
        swing
            (4, 4) what it did to the part, in the base frame.
        glance
            As things stand after it.
        stay
            Whether the arm can stay.

        """
        turn = turn_across(self.T_base_plate, T_base_burr, glance.off_mm[0], sheet=self._station.table.sheet)
        if turn is None or not glance.upright(tolerance_mm):
            return np.eye(4), glance, False
        if abs(glance.off_mm[0]) < turn.sigma_mm:  # it would add more than it takes away
            return np.eye(4), glance, True
        self.turn_deg += turn.deg
        before = self.T_base_plate
        self.T_base_plate = self._station.table.move(turned(self._station.T_base_plate, self.turn_deg))
        swing = np.asarray(self.T_base_plate @ np.linalg.inv(before), float)
        off, tilt = _off(self._station, glance.T_base_camera, swing @ T_base_burr, glance.height_mm)
        sigma = float(np.hypot(glance.off_sigma_mm, turn.sigma_mm))
        after = replace(glance, off_mm=off, off_sigma_mm=sigma, tilt_deg=tilt, turned_deg=turn.deg)
        return swing, after, True


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
