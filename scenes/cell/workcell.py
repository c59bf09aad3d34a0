"""The cell itself: a scene whose part stands on a table and whose scanner hangs on an arm."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from burrscan.arrays import Floats, Image
from burrscan.cell.station import Station, turned
from burrscan.devices import CameraSheet, ProjectorSheet
from burrscan.rig import Rig
from burrscan.scanner import Patterns, Scanner
from scenes.cell.bodies import bodies
from scenes.cell.errors import AttainedPoses, motion
from scenes.cell.milling import milled
from scenes.cell.positioners import SimulatedArm, SimulatedTable
from scenes.cell.spec import CellSpec
from scenes.pose import pose_of
from scenes.scene import SceneSpec
from scenes.simulate import Simulation, simulate
from scenes.stores import Store
from scenes.wheel import Cut, Wheel, build_wheel

_TILT_DEG = 25.0
"""Between the mill and the camera's axis."""
_ASIDE = 0.16
"""How far beside the picture's middle its end is seen, in working distances: a default camera sees 0.233."""
_MOUNT = motion(np.array([-60.0, 40.0, 90.0, 0.05, -0.08, 0.6]))
"""The camera on the flange, somehow."""


class SimulatedCell:
    """A scene in a cell.

    Parameters
    ----------
    scene
        The part, its finish, the rig and the electronics; its pose is not used.
    spec
        The cell.
    identity
        Of the case: fixes every error and all noise.
    cache_dir
        Where traced light is kept.
    wheel
        Of the scene, where it is built already.

    """

    def __init__(
        self,
        scene: SceneSpec,
        spec: CellSpec,
        *,
        identity: tuple[int, ...] = (0,),
        cache_dir: Path | Store | None = None,
        wheel: Wheel | None = None,
    ) -> None:
        self.spec = spec
        self.scene = scene
        self._identity, self._cache_dir = identity, cache_dir
        self.wheel = wheel or build_wheel(scene.wheel, scene.burrs)
        z = self.wheel.generatrix_zr_mm[:, 0]
        self._middle_z_mm = float(0.5 * (z.min() + z.max()))
        rng = self._stream("placed")
        upright = _on_plate(float(z.min())) @ _nudge(rng, spec.placed_mm, spec.placed_deg)
        self.T_plate_part = turned(upright, float(self._stream("turned").uniform(0.0, spec.turned_deg)))
        self._told_middle = np.array([0.0, 0.0, 0.5 * float(np.ptp(z))])
        self._tool = _tool(scene.rig.standoff_mm)
        self._plate = np.eye(4)
        self._plate[:3, 3] = spec.arm.distance_mm, 0.0, -spec.arm.shoulder_mm
        self._around = bodies(
            scene.rig.rig(),
            T_flange_camera=_MOUNT,
            T_flange_tool=_MOUNT @ self._tool,
            mill_length_mm=spec.mill.length_mm,
        )
        self.table = SimulatedTable(
            spec.table.sheet,
            AttainedPoses(spec.table.sheet, identity=identity, source="table"),
            T_home=self._plate,
        )
        home = np.eye(4)
        home[:3, 3] = 0.4 * spec.arm.reach_mm, 0.0, 0.5 * spec.arm.reach_mm
        self.arm = SimulatedArm(
            spec.arm.sheet,
            AttainedPoses(spec.arm.sheet, identity=identity, source="arm"),
            T_home=home,
            refuse=self._refuse,
            moved=lambda: self.trace.append(self.T_part_tool),
        )
        self.trace: list[Floats] = []
        self.cuts: list[Cut] = []
        self._looks = 0
        self._seen: tuple[Floats, Simulation] | None = None

    def station(self) -> Station:
        """What the cell's software is told; its knowledge of the flange is as good as a calibration's."""
        arm = self.spec.arm
        return Station(
            arm=self.arm,
            table=self.table,
            scanner=_Eye(self),
            T_flange_camera=_MOUNT @ _nudge(self._stream("hand-eye"), arm.hand_eye_mm, arm.hand_eye_deg),
            T_camera_tool=self._tool,
            T_base_plate=self._plate,
            standoff_mm=self.scene.rig.standoff_mm,
            middle_mm=self._told_middle,
            spindle=_Mill(self),
        )

    @property
    def T_camera_part(self) -> Floats:  # noqa: N802 (T_target_source)
        """(4, 4) the truth: where the part is in the camera's frame now."""
        return np.asarray(
            np.linalg.inv(self.arm.T_true @ _MOUNT) @ self.table.T_true @ self.T_plate_part, float
        )

    @property
    def T_part_tool(self) -> Floats:  # noqa: N802
        """(4, 4) the truth: where the mill is over the part now."""
        return np.asarray(np.linalg.inv(self.T_camera_part) @ self._tool, float)

    def disturb(self) -> None:
        """Somebody bumps into the part: it slides on the table and turns a little."""
        rng = self._stream("moved")
        angle, axis = rng.uniform(0.0, 2.0 * np.pi), rng.normal(size=3)
        slide = self.spec.moved_mm * np.array([np.cos(angle), np.sin(angle), 0.0])
        turn = np.radians(self.spec.moved_deg) * axis / np.linalg.norm(axis)
        about = np.eye(4)
        about[:3, 3] = self._told_middle
        self.T_plate_part = (
            about @ motion(np.concatenate([slide, turn])) @ np.linalg.inv(about) @ self.T_plate_part
        )

    def seen(self) -> Simulation:
        """The scene from where the camera is now: its light and its truth."""
        pose = self.T_camera_part
        if self._seen is None or not np.array_equal(self._seen[0], pose):
            at = pose_of(pose, standoff_mm=self.scene.rig.standoff_mm, middle_z_mm=self._middle_z_mm)
            self._looks += 1
            simulation = simulate(
                replace(self.scene, pose=at),
                identity=(*self._identity, self._looks),
                cache_dir=self._cache_dir,
                milled=tuple(self.cuts),
            )
            self._seen = (pose, simulation)
        return self._seen[1]

    def cut_along(self, tools: Sequence[Floats]) -> None:
        """The mill has cut while it went through these true poses (4, 4) over the part, ``T_part_tool``."""
        self.cuts += milled(self.wheel, self.cuts, np.array(tools), self.spec.mill)
        self._seen = None

    def _refuse(self, T_base_flange: Floats) -> None:
        self._around.refuse_touching(
            T_base_flange,
            T_base_plate=self.table.T_true,
            T_plate_part=self.T_plate_part,
            generatrix_zr_mm=self.wheel.generatrix_zr_mm,
            plate_radius_mm=self.spec.table.radius_mm,
        )

    def _stream(self, source: str) -> np.random.Generator:
        key = (zlib.crc32(f"cell {source}".encode()),)
        return np.random.default_rng(np.random.SeedSequence(self._identity, spawn_key=key))


class _Mill:
    """The spindle: what the mill goes through between start and stop is cut, whether arm or table moves."""

    def __init__(self, cell: SimulatedCell) -> None:
        self._cell = cell
        self._since = 0

    def start(self) -> None:
        self._since = len(self._cell.trace)

    def stop(self) -> None:
        gone = self._cell.trace[self._since :]
        if len(gone) > 1:
            self._cell.cut_along(gone)


class _Eye:
    """The scanner on the flange: each capture sees the part from where the arm is."""

    def __init__(self, cell: SimulatedCell) -> None:
        self._cell = cell
        self._at: tuple[Simulation, Scanner] | None = None

    @property
    def _scanner(self) -> Scanner:
        seen = self._cell.seen()
        if self._at is None or self._at[0] is not seen:
            self._at = (seen, seen.scanner())
        return self._at[1]

    @property
    def rig(self) -> Rig:
        scene = self._cell.scene
        return scene.calibration.told(scene.rig.rig())

    @property
    def camera(self) -> CameraSheet:
        return self._cell.scene.camera.sheet

    @property
    def projector(self) -> ProjectorSheet:
        return self._cell.scene.projector.sheet

    def capture(self, patterns: Patterns, exposure_ms: float) -> Image:
        return self._scanner.capture(patterns, exposure_ms)


def _on_plate(lowest_mm: float) -> Floats:
    """The part upright on the plate."""
    transform = np.eye(4)
    transform[2, 3] = -lowest_mm
    return transform


def _nudge(rng: np.random.Generator, sigma_mm: float, sigma_deg: float) -> Floats:
    return motion(rng.normal(size=6) * np.array([sigma_mm] * 3 + [np.radians(sigma_deg)] * 3))


def _tool(standoff_mm: float) -> Floats:
    """The mill in the camera's frame: its end to the left in what the camera sees, away from the projector.

    So camera and projector lie in one plane with the mill, and look along a burr that the mill follows: both
    of its flanks are seen alike, and none mirrors the part inside the epipolar plane.
    """
    s, c = np.sin(np.radians(_TILT_DEG)), np.cos(np.radians(_TILT_DEG))
    return np.array(
        [
            [-c, 0.0, -s, -_ASIDE * standoff_mm],
            [0.0, 1.0, 0.0, 0.0],
            [s, 0.0, -c, standoff_mm],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )
