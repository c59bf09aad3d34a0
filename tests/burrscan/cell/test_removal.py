"""The look after a burr was milled, in the servo's world: what it says of places whose relief is known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from burrscan.arrays import Floats
from burrscan.cell import removal as module
from burrscan.cell.positioner import OutOfReachError
from burrscan.cell.removal import verify
from burrscan.cell.servo import Glance, Servoed
from burrscan.errors import InputError
from tests.burrscan.cell.parts import burr
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
