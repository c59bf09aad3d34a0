"""The servo in a world whose scans are exact points of a drum with a ridge, and whose arm is not."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest

from burrscan.arrays import Floats
from burrscan.axis.basis import T_part_mesh
from burrscan.cell import servo as module
from burrscan.cell.positioner import OutOfReachError, PositionerSheet
from burrscan.cell.servo import HEIGHTS_MM, Glance, servo
from burrscan.cell.station import Station, turned
from burrscan.errors import InputError
from burrscan.generatrix import deviation_mm
from burrscan.inspection import Axis, Generatrix, Inspection
from scenes.cell.errors import AttainedPoses, motion
from scenes.rig import RigSpec
from tests.burrscan.cell.parts import RADIUS_MM, burr, generatrix
from tests.burrscan.cell.test_planners import Blind

_SHEET = PositionerSheet(reach_mm=1300.0)


class _Fine(Blind):
    """A camera whose pixels are as wide as the points of the world lie apart."""

    rig = RigSpec(scale=0.45).rig()


class Turntable:
    """A table with errors."""

    sheet = PositionerSheet(
        reach_mm=0.0, repeatability_mm=0.005, repeatability_deg=0.003, accuracy_mm=0.02, accuracy_deg=0.01
    )

    def __init__(self, T_base_plate: Floats, seed: int) -> None:
        self.attained = AttainedPoses(self.sheet, identity=(seed,), source="table")
        self.T_base_plate = T_base_plate
        self.asked: list[Floats] = []

    def move(self, T_base_plate: Floats) -> Floats:
        self.asked.append(T_base_plate)
        self.T_base_plate = self.attained.attained(T_base_plate)
        return T_base_plate


class World:
    """A drum with a ridge at angle 180 over a table, a camera on an arm with errors."""

    def __init__(self, seed: int, *, moved: Floats | None = None, noise_mm: float = 0.01) -> None:
        self.rng = np.random.default_rng(seed)
        self.attained = AttainedPoses(_SHEET, identity=(seed,), source="arm")
        self.sheet = _SHEET
        self.noise_mm = noise_mm
        self.T_plate_part = np.eye(4) if moved is None else moved
        self.T_base_home = np.eye(4)
        self.T_base_home[:3, 3] = 900.0, 0.0, -300.0
        self.table = Turntable(self.T_base_home, seed)
        self.T_base_flange = np.eye(4)
        self.T_camera_tool = np.array([[-1.0, 0, 0, 0], [0, 1.0, 0, 0], [0, 0, -1.0, 600.0], [0, 0, 0, 1.0]])
        self.looks = 0

    def move(self, T_base_flange: Floats) -> Floats:
        self.T_base_flange = self.attained.attained(T_base_flange)
        return T_base_flange

    def station(self) -> Station:
        return Station(
            arm=self, table=self.table, scanner=_Fine(), T_flange_camera=np.eye(4),
            T_camera_tool=self.T_camera_tool, T_base_plate=self.T_base_home, standoff_mm=600.0,
            middle_mm=np.array([0.0, 0.0, 20.0]),
        )  # fmt: skip

    @property
    def T_part_tool(self) -> Floats:  # noqa: N802 (T_target_source)
        part = self.table.T_base_plate @ self.T_plate_part
        return np.asarray(np.linalg.inv(part) @ self.T_base_flange @ self.T_camera_tool)

    def relief(self, off_mm: Floats, z_mm: Floats) -> Floats:
        """Heights over the drum, by the place across and along its axis; NaN where nothing is measured."""
        return np.where(np.abs(z_mm - 20.0) < 5.0, np.clip(1.0 - np.abs(off_mm) / 0.75, 0.0, None), 0.0)

    def scan(self, _scanner: object, _pipeline: object) -> Any:
        """An outcome as the pipeline would give it, of the side that faces the camera."""
        self.looks += 1
        angle, z = np.meshgrid(np.pi + np.arange(-0.6, 0.6, 0.4 / RADIUS_MM), np.arange(0.2, 39.8, 0.4))
        angle += 0.4 / RADIUS_MM * z / 10.0  # rows of pixels cross the ridge at a slant
        relief = self.relief((angle - np.pi) * RADIUS_MM, z)
        radius = RADIUS_MM + relief + self.noise_mm * self.rng.normal(size=relief.shape)
        part = np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=-1).reshape(-1, 3)
        part = part[np.isfinite(relief).ravel()]
        pose = np.linalg.inv(self.T_base_flange) @ self.table.T_base_plate @ self.T_plate_part
        points = part @ pose[:3, :3].T + pose[:3, 3]
        direction = pose[:3, :3] @ [0.0, 0.0, 1.0]
        axis = Axis(pose[:3, 3] + 20.0 * direction, direction, np.eye(4) * 1e-8, "given")
        frame = T_part_mesh(axis.point_mm, axis.direction)
        shift = float((frame @ pose)[2, 3])
        line = generatrix()
        curve = Generatrix(line.z_mm + shift, line.r_mm, line.sigma_mm, line.band_mm)
        inspection = Inspection(axis, curve, (), frame, deviation_mm(points, axis, curve))
        noise = np.full(len(points), self.noise_mm)
        surface = SimpleNamespace(vertices_mm=points, vertex_sigma_mm=noise, points_mm=np.empty((0, 0, 3)))
        scan = SimpleNamespace(radiance=None)  # no light: by depth alone
        return SimpleNamespace(scan=scan, surface=surface, inspection=inspection)


def _run(world: World, monkeypatch: pytest.MonkeyPatch, **options: Any) -> Any:
    monkeypatch.setattr(module, "run", world.scan)
    target = burr(180.0)
    return servo(world.station(), target, np.array(target.T_mesh_burr), **options)


def _off(world: World, height: float) -> tuple[float, float]:
    """True place of the mill over the ridge: across, and over the surface."""
    x, y, _ = world.T_part_tool[:3, 3]
    turn = np.arctan2(y, x) - np.pi
    return float(np.hypot(x, y) * np.sin(turn)), float(np.hypot(x, y) * np.cos(turn)) - RADIUS_MM - height


@pytest.mark.parametrize("seed", range(6))
def test_the_mill_comes_over_the_burr_of_a_part_that_was_moved(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(100 + seed)
    way = rng.normal(size=3)
    twist = np.concatenate([2.0 * way / np.linalg.norm(way), np.radians(0.6) * rng.normal(size=3)])
    world = World(seed, moved=motion(twist))
    reached = _run(world, monkeypatch)
    assert reached.converged, reached.why
    assert len(reached.glances) <= 4
    across, normal = _off(world, reached.glances[-1].height_mm)
    # what was measured within 0.05 mm is true within it and what is stated of the measurement
    assert abs(across) < 0.05 + 3.0 * reached.glances[-1].off_sigma_mm
    assert abs(normal) < 0.065


@pytest.mark.parametrize(
    ("across", "sigma", "normal", "tilt", "expected"),
    [
        (0.0, 0.05, 0.0, 0.1, 0.6827),  # one standard deviation to both sides
        (0.05, 0.01, 0.04, 0.1, 0.5),
        (-0.03, 0.02, -0.05, 0.5, 0.8413),
        (0.0, 0.01, 0.051, 0.1, 0.0),
        (0.0, 0.01, 0.0, 0.6, 0.0),
    ],
)
def test_how_sure_the_mill_is_over_the_burr(
    *, across: float, sigma: float, normal: float, tilt: float, expected: float
) -> None:
    glance = Glance(np.eye(4), 8.0, np.eye(4), (across, normal), sigma, tilt)
    assert glance.sure(0.05) == pytest.approx(expected, abs=1e-4)


@pytest.mark.study
def test_of_those_that_stop_as_many_are_within_the_tolerance_as_is_said(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    within, sure = [], []
    for seed in range(60):
        world = World(seed, noise_mm=0.2)
        reached = _run(world, monkeypatch, sure=0.7)
        if reached.converged:
            last = reached.glances[-1]
            within.append(abs(_off(world, last.height_mm)[0]) <= 0.05)
            sure.append(last.sure(0.05))
    assert len(within) >= 30
    spread = np.sqrt(np.mean(np.multiply(sure, np.subtract(1.0, sure))) / len(sure))
    assert abs(np.mean(within) - np.mean(sure)) < 2.6 * spread  # two sides, one in a hundred
    assert np.mean(within) > 0.7 - 2.6 * spread


def test_once_the_mill_is_upright_the_table_turns_and_the_arm_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    """The arm's next move scatters by as much as it corrects: of perfect looks seven of eight stopped."""
    stopped, off = 0, []
    for seed in range(40):
        world = World(seed, noise_mm=0.002)
        reached = _run(world, monkeypatch)
        stopped += reached.converged
        off.append(abs(_off(world, reached.glances[-1].height_mm)[0]))
        turns = [glance.turned_deg for glance in reached.glances]
        assert len(world.table.asked) == 1 + sum(turn != 0.0 for turn in turns)
        stands = [glance.T_base_camera for glance in reached.glances]
        for before, after, turn in zip(stands[:-1], stands[1:], turns[:-1], strict=True):
            assert turn == 0.0 or np.array_equal(before, after)
    assert stopped >= 39
    assert np.mean(np.array(off) < 0.05) >= 0.95


def test_a_burr_that_the_table_cannot_move_across_is_reached_by_the_arm(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "turn_across", lambda *_, **__: None)
    world = World(2)
    reached = _run(world, monkeypatch)
    assert len(world.table.asked) == 1
    assert all(glance.turned_deg == 0.0 for glance in reached.glances)
    assert reached.converged


def test_the_mesh_of_the_last_look_turns_with_the_part(monkeypatch: pytest.MonkeyPatch) -> None:
    turned_last = 0
    for seed in range(8):
        world = World(seed)
        reached = _run(world, monkeypatch)
        last = reached.glances[-1]
        swing = np.linalg.inv(world.T_base_home) @ reached.T_base_mesh @ np.linalg.inv(last.T_base_camera)
        swing = swing @ world.T_base_home  # in the frame of the plate: about its z
        assert np.allclose(swing, turned(np.eye(4), last.turned_deg), atol=1e-9)
        turned_last += last.turned_deg != 0.0
    assert turned_last >= 4


def test_without_looking_the_arm_is_off_by_more(monkeypatch: pytest.MonkeyPatch) -> None:
    off = []
    for seed in range(6):
        world = World(seed)
        _run(world, monkeypatch, most=1)
        off.append(max(map(abs, _off(world, HEIGHTS_MM[0]))))
    assert np.median(off) > 0.3  # what an open loop would leave


def test_a_burr_that_is_not_there_is_no_convergence(monkeypatch: pytest.MonkeyPatch) -> None:
    far = motion(np.array([0.0, 14.0, 0.0, 0.0, 0.0, 0.0]))  # much farther than anybody shifts a part
    reached = _run(World(1, moved=far), monkeypatch)
    assert not reached.converged
    assert "near its place" in reached.why


def test_looks_that_disagree_never_pass_for_agreement(monkeypatch: pytest.MonkeyPatch) -> None:
    class Shaky(World):
        def scan(self, scanner: object, pipeline: object) -> Any:
            # each look sees the part somewhere else, as a part that rocks would
            self.T_plate_part = motion(np.array([*(0.4 * self.rng.normal(size=3)), 0.0, 0.0, 0.0]))
            return super().scan(scanner, pipeline)

    reached = [_run(Shaky(seed), monkeypatch) for seed in range(8)]
    assert sum(one.converged for one in reached) <= 2  # 0.05 mm of 0.4 happens by chance
    assert all("leave" in one.why for one in reached if not one.converged)


def test_a_view_without_a_part_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(_scanner: object, _pipeline: object) -> Any:
        raise InputError("only 3 usable vertices")

    monkeypatch.setattr(module, "run", nothing)
    target = burr(180.0)
    reached = servo(World(0).station(), target, np.array(target.T_mesh_burr))
    assert not reached.converged
    assert "usable vertices" in reached.why


@pytest.mark.parametrize(("refused", "turns"), [(False, [180.0, 0.0, 180.0]), (True, [0.0, 0.0, 0.0])])
def test_after_a_look_in_vain_the_scanner_comes_from_the_other_end_where_the_arm_can(
    *, refused: bool, turns: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    class Recording(World):
        asked: ClassVar[list[Floats]] = []

        def move(self, T_base_flange: Floats) -> Floats:
            if refused and self.asked and self.asked[0][:3, 0] @ T_base_flange[:3, 0] < 0.0:
                raise OutOfReachError("the elbow touches the table")
            self.asked.append(T_base_flange)
            return super().move(T_base_flange)

        def scan(self, _scanner: object, _pipeline: object) -> Any:
            raise InputError("only 3 usable vertices")

    Recording.asked = []
    reached = _run(Recording(0), monkeypatch)
    # one move for each look
    assert len(Recording.asked) == len(reached.glances) == 4
    cosines = [float(Recording.asked[0][:3, 0] @ flange[:3, 0]) for flange in Recording.asked[1:]]
    assert np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0))) == pytest.approx(turns, abs=1e-3)
