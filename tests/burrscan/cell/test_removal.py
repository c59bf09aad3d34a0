"""The look after a burr was milled, in the servo's world: what it says of places whose relief is known."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from burrscan.arrays import Floats
from burrscan.cell import feed as feed_module
from burrscan.cell import removal as module
from burrscan.cell.feed import along_its_edge, mill
from burrscan.cell.positioner import OutOfReachError
from burrscan.cell.removal import verify
from burrscan.cell.servo import Glance, Servoed
from burrscan.cell.station import turned
from burrscan.cell.toolpath import ToolPath
from burrscan.errors import InputError
from burrscan.inspection import Axis
from tests.burrscan.cell.parts import RADIUS_MM, burr
from tests.burrscan.cell.test_servo import World


class Milled(World):
    """What a mill left: 0.1 mm of the burr's upper end, 0.06 mm too deep at its lower; a bump beside."""

    asked: list[Floats]

    def relief(self, off_mm: Floats, z_mm: Floats) -> Floats:
        over = np.abs(off_mm) < 2.0
        high = np.where(over & (z_mm > 21.5) & (z_mm < 26.0), 0.1, 0.0)
        low = np.where(over & (z_mm > 14.0) & (z_mm < 18.5), -0.06, 0.0)
        beside = np.where((off_mm > 5.0) & (off_mm < 8.0), 0.9, 0.0)
        return high + low + beside

    def move(self, T_base_flange: Floats) -> Floats:
        self.asked = [*getattr(self, "asked", []), T_base_flange]
        return super().move(T_base_flange)


class Mirror(Milled):
    """From one end the place sends no light back."""

    def relief(self, off_mm: Floats, z_mm: Floats) -> Floats:
        """Measured when the camera's x axis points down only."""
        heights = super().relief(off_mm, z_mm)
        dark = self.T_base_flange[2, 0] > 0.0
        return np.where(dark & (np.abs(off_mm) < 3.0), np.nan, heights)


def _servoed(world: World, *, up: bool = True) -> Servoed:
    """The mill 8 mm over the burr, the camera's x axis along it, upwards or downwards; a perfect servo."""
    target = burr(180.0)
    T_base_burr = np.asarray(world.T_base_home @ target.T_mesh_burr, float)
    T_base_tool = T_base_burr.copy()
    T_base_tool[:3, 3] += 8.0 * T_base_burr[:3, 2]
    # the mill's x axis points against the camera's
    T_base_tool[:3, :2] *= -1.0 if up else 1.0
    camera = T_base_tool @ np.linalg.inv(world.T_camera_tool)
    near = np.asarray(np.linalg.inv(camera) @ T_base_burr, float)
    place = burr(180.0)
    object.__setattr__(place, "T_mesh_burr", near)
    return Servoed(True, "", (Glance(camera, 8.0, T_base_burr),), place, T_base_mesh=camera)


def _verified(world: World, servoed: Servoed, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.setattr(module, "run", world.scan)
    return verify(world.station(), servoed)


@pytest.mark.parametrize("seed", range(4))
def test_what_is_left_and_what_is_cut_is_measured_at_the_place_only(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    world = Milled(seed)
    said = _verified(world, _servoed(world), monkeypatch)
    # a patch has about 14 points of 0.01 mm, 4 at least: the highest is 2 sigma of their mean over it
    assert said.residual_mm.value == pytest.approx(0.1, abs=0.01)
    assert said.gouge_mm.value == pytest.approx(0.06, abs=0.01)
    assert 0.01 / 5.0 < said.residual_mm.sigma <= 0.01 / 2.0
    assert said.measured == 1.0
    assert not said.called
    assert world.looks == 1


def test_the_arm_goes_back_to_where_the_last_look_was_made(monkeypatch: pytest.MonkeyPatch) -> None:
    world = Milled(0)
    servoed = _servoed(world)
    _verified(world, servoed, monkeypatch)
    assert np.allclose(world.asked, [servoed.glances[-1].T_base_camera], atol=1e-9)


def test_where_the_place_mirrors_it_is_looked_at_from_its_other_end(monkeypatch: pytest.MonkeyPatch) -> None:
    world = Mirror(1)
    said = _verified(world, _servoed(world), monkeypatch)
    assert world.looks == 2
    assert said.measured > 0.9
    assert said.residual_mm.value == pytest.approx(0.1, abs=0.015)
    assert said.gouge_mm.value == pytest.approx(0.06, abs=0.015)
    # the arm's error is another one there: two standard deviations of it are added to the place
    here = _verified(Mirror(1), _servoed(Mirror(1), up=False), monkeypatch)
    sheet, lever = world.sheet, world.station().lever_mm
    more = 2.0 * np.hypot(sheet.offset_mm, lever * np.radians(sheet.offset_deg))
    assert np.subtract(said.site.half_mm, here.site.half_mm) == pytest.approx([more, more])
    # turned half round about the mill: the mill is where it was
    first, second = (flange @ world.T_camera_tool for flange in world.asked)
    assert np.allclose(first[:3, 3], second[:3, 3])
    assert np.allclose(first[:3, 0], -second[:3, 0])


def test_from_the_end_that_sees_it_one_look_is_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    world = Mirror(1)
    said = _verified(world, _servoed(world, up=False), monkeypatch)
    assert world.looks == 1
    assert said.measured == 1.0


def test_where_the_arm_cannot_turn_round_nothing_is_claimed(monkeypatch: pytest.MonkeyPatch) -> None:
    class Stuck(Mirror):
        def move(self, T_base_flange: Floats) -> Floats:
            if getattr(self, "asked", []):
                raise OutOfReachError("the elbow touches the table")
            return super().move(T_base_flange)

    world = Stuck(2)
    said = _verified(world, _servoed(world), monkeypatch)
    assert np.isnan(said.residual_mm.value)
    assert np.isnan(said.gouge_mm.value)
    assert said.measured == 0.0


def test_a_look_that_shows_no_part_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    world = Milled(3)

    def nothing(_scanner: object, _pipeline: object) -> Any:
        raise InputError("only 3 usable vertices")

    monkeypatch.setattr(module, "run", nothing)
    said = verify(world.station(), _servoed(world))
    assert said.outcome is None
    assert "usable vertices" in said.why
    assert len(world.asked) == 2  # it tried from both ends


def test_a_place_that_was_not_reached_is_not_judged() -> None:
    with pytest.raises(InputError, match="4 looks leave"):
        verify(World(0).station(), Servoed(False, "4 looks leave 0.2 mm", (), None))


class Spindle:
    """Notes how often it was started and stopped."""

    def __init__(self) -> None:
        self.said: list[str] = []

    def start(self) -> None:
        self.said.append("start")

    def stop(self) -> None:
        self.said.append("stop")


def _around(world: World, *, half_deg: float, axial: bool, up: float = 1.0) -> tuple[ToolPath, Servoed]:
    """A path over an arc of the drum, the mill upright on its round side or flat on its end face.

    The axis that the look found may point ``up`` or down.
    """
    angles = np.radians(180.0 + np.linspace(-half_deg, half_deg, 9))
    poses = []
    for angle in angles:
        radial, tangent = [np.cos(angle), np.sin(angle), 0.0], [-np.sin(angle), np.cos(angle), 0.0]
        out = [0.0, 0.0, 1.0] if axial else radial
        pose = np.eye(4)
        pose[:3, :3] = np.stack([tangent, np.cross(out, tangent), out], axis=1)
        pose[:3, 3] = RADIUS_MM * np.array(radial) + [0.0, 0.0, 40.0]
        poses.append(world.T_base_home @ pose)
    middle = poses[4]
    reached = replace(burr(180.0), T_mesh_burr=middle)
    camera = turned(middle, 70.0) @ np.linalg.inv(world.T_camera_tool)
    axis = Axis(world.T_base_home[:3, 3], np.array([0.0, 0.0, up]), np.eye(4), "given")
    outcome = SimpleNamespace(inspection=SimpleNamespace(axis=axis))
    glance = Glance(camera, 8.0, middle, outcome=cast(Any, outcome))
    servoed = Servoed(True, "", (glance,), reached, T_base_mesh=np.eye(4))
    path = ToolPath(np.stack(poses), np.zeros(9, np.int64), (0.4, 0.0), 20.0, 10.0, 1.0)
    return path, servoed


class Still(World):
    """An arm and a table without errors, which note where the mill is over the plate."""

    def __init__(self) -> None:
        super().__init__(0)
        self.flanges: list[Floats] = []
        self.over: list[Floats] = []
        self.attained = self.table.attained = cast(Any, SimpleNamespace(attained=lambda pose: pose))

    def move(self, T_base_flange: Floats) -> Floats:
        self.flanges.append(T_base_flange)
        self.over.append(np.linalg.inv(self.table.T_base_plate) @ T_base_flange @ self.T_camera_tool)
        return super().move(T_base_flange)


@pytest.mark.parametrize("up", [1.0, -1.0])
@pytest.mark.parametrize("axial", [True, False])
def test_along_an_edge_the_table_turns_the_part_under_a_flange_that_stays(*, axial: bool, up: float) -> None:
    world, spindle = Still(), Spindle()
    path, servoed = _around(world, half_deg=15.0, axial=axial, up=up)
    mill(replace(world.station(), spindle=spindle), path, servoed)
    wanted = [path.above(0), *(pose for _, pose in path.travel()), path.above(path.last)]
    planned = np.linalg.inv(world.T_base_home) @ np.array(wanted)
    over = np.array(world.over)
    assert over[:, :3, 3] == pytest.approx(planned[:, :3, 3], abs=1e-9)
    assert over[:, :3, 2] == pytest.approx(planned[:, :3, 2], abs=1e-9)
    turns = Rotation.from_matrix(np.array(world.flanges)[:, :3, :3])
    stood = Rotation.from_matrix(servoed.glances[-1].T_base_camera[:3, :3])
    assert (stood.inv() * turns).magnitude().max() < 1e-9
    assert np.ptp(np.array(world.flanges)[:, 1, 3]) < 1e-9  # it stays in the burr's meridian
    assert spindle.said == ["start", "stop"]
    assert world.table.T_base_plate == pytest.approx(world.T_base_home)


def test_a_path_along_an_edge_goes_where_looks_at_its_ends_see_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """The arm takes the table's axis for 0.8 mm beside its place: the ends are off by that times the turn."""
    world = Still()
    path, servoed = _around(world, half_deg=15.0, axial=False)
    off = np.array([0.3, -0.8, 0.5])
    station = world.station()

    def seen(_outcome: object, T_camera_expected: Floats, *, gate_mm: float) -> Floats:
        assert gate_mm > 0.5
        told = np.linalg.inv(world.T_base_home) @ world.table.T_base_plate  # about the axis as it is told
        about = np.eye(4)
        about[:3, 3] = off
        really = about @ told @ np.linalg.inv(about)
        moved = world.T_base_home @ really @ np.linalg.inv(told) @ np.linalg.inv(world.T_base_home)
        camera = world.flanges[-1]
        return np.asarray(np.linalg.inv(camera) @ moved @ camera @ T_camera_expected, float)

    monkeypatch.setattr(feed_module, "run", lambda *_: None)
    monkeypatch.setattr(feed_module, "edge_now", seen)
    bent = along_its_edge(station, path, servoed)
    shift = bent.stations[:, :3, 3] - path.stations[:, :3, 3]
    angle = np.radians(np.linspace(-15.0, 15.0, 9))
    for turn, by, pose in zip(angle, shift, path.stations, strict=True):
        # the part, turned back about an axis that is off by (0.3, -0.8), lies so much elsewhere
        back = Rotation.from_euler("z", -turn).as_matrix()
        there = Rotation.from_euler("z", turn).as_matrix() @ (off - back @ off)
        wanted = pose[:3, :3].T @ there
        assert (pose[:3, :3].T @ by)[1:] == pytest.approx(wanted[1:], abs=0.004)
    assert np.abs(shift[4]).max() < 1e-9
    assert np.abs(shift[[0, -1]]).max() > 0.1
    assert len(world.flanges) == 2
    assert world.table.T_base_plate == pytest.approx(world.T_base_home)
    monkeypatch.setattr(feed_module, "edge_now", lambda *_, **__: None)
    with pytest.raises(InputError, match=r"edge .* not seen"):
        along_its_edge(station, path, servoed)
    assert world.table.T_base_plate == pytest.approx(world.T_base_home)


def test_along_the_generatrix_the_table_stays() -> None:
    world = Still()
    path, servoed = _around(world, half_deg=0.0, axial=False)
    upright = np.array(path.stations)
    upright[:, :3, :2] = np.stack([upright[:, :3, 1], -upright[:, :3, 0]], axis=2)  # its feed is upwards
    upright[:, 2, 3] += np.arange(9.0)
    assert servoed.burr is not None
    along = replace(servoed, burr=replace(servoed.burr, T_mesh_burr=upright[4]))
    there = replace(path, stations=upright)
    assert along_its_edge(world.station(), there, along) is there
    mill(replace(world.station(), spindle=Spindle()), there, along)
    assert not world.table.asked
    assert len(world.flanges) == 2 * 9 + 2


def test_the_place_of_a_burr_around_the_axis_is_as_wide_as_its_arc_is_deep(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    world = Milled(5)
    servoed = _servoed(world)
    straight = _verified(world, servoed, monkeypatch).site.half_mm
    outcome = world.scan(None, None)
    glance = replace(servoed.glances[-1], outcome=outcome)
    assert servoed.burr is not None
    same = _verified(world, replace(servoed, glances=(glance,)), monkeypatch).site.half_mm
    assert same == pytest.approx(straight, abs=1e-3)  # it lies along the axis
    pose = np.array(servoed.burr.T_mesh_burr)
    pose[:3, :2] = np.stack([pose[:3, 1], -pose[:3, 0]], axis=1)
    around = replace(servoed, burr=replace(servoed.burr, T_mesh_burr=pose), glances=(glance,))
    wide = _verified(world, around, monkeypatch).site.half_mm
    deep = servoed.burr.length_mm.value**2 / (8.0 * RADIUS_MM)
    assert wide[1] - straight[1] == pytest.approx(deep, rel=0.02)


@pytest.mark.parametrize("without", ["spindle", "burr"])
def test_nothing_is_milled_without_a_spindle_or_a_burr(without: str) -> None:
    world = Still()
    path, servoed = _around(world, half_deg=5.0, axial=True)
    station = world.station() if without == "spindle" else replace(world.station(), spindle=Spindle())
    reached = servoed if without == "spindle" else Servoed(False, "4 looks leave 0.2 mm", (), None)
    with pytest.raises(InputError, match="no spindle" if without == "spindle" else "4 looks leave"):
        mill(station, path, reached)
    assert not world.flanges
