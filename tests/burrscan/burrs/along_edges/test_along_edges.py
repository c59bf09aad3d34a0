"""Burrs on the edge of a cylinder, by formulas: what is dark and has odd depths along it, and what is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from burrscan.arrays import Bools
from burrscan.burrs.along_edges.call import along_edges
from burrscan.inspection import Burr, Side, Value
from tests.burrscan.burrs.light.scene import HALF_LENGTH_MM, Scene, burrs_of

_TILTED = (0.2, 1.0, 0.1)


def _stretch(scene: Scene, around_mm: float, length_mm: float, high_mm: float = 2.5) -> Bools:
    """Pixels of a stretch of the far end's edge."""
    return scene.band(around_mm, length_mm, HALF_LENGTH_MM - high_mm, HALF_LENGTH_MM)


def _burr(
    scene: Scene, around_mm: float = -25.0, length_mm: float = 14.0, *, log_light: float = -0.8
) -> None:
    """A burr: light changed by a factor, two thirds of the depths lost, the rest off."""
    cells = _stretch(scene, around_mm, length_mm)
    scene.log_light[cells] += log_light
    scene.lost |= cells & (np.random.default_rng(7).random(cells.shape) < 0.66)
    scene.lift_mm[cells] -= 0.3


def _called(scene: Scene, *called: Burr, unit: float = 1.0) -> list[Burr]:
    return along_edges(scene.sight(unit=unit), scene.axis, scene.generatrix, called=called)


@pytest.mark.parametrize("direction", [(0.0, 1.0, 0.0), _TILTED])
@pytest.mark.parametrize("log_light", [-0.8, 0.8])
def test_a_burr_along_an_edge_is_called_where_it_is(
    direction: tuple[float, float, float], log_light: float
) -> None:
    scene = Scene(direction=direction)
    _burr(scene, log_light=log_light)
    pixel_mm = 600.0 / scene.rig.camera.fx
    (burr,) = _called(scene)
    assert burr.side == "protrusion"
    place = scene.in_part(scene.place_mm(-25.0, HALF_LENGTH_MM))
    assert burr.angle_deg.value == pytest.approx(
        np.degrees(np.arctan2(place[1], place[0])), abs=3.0 * burr.angle_deg.sigma
    )
    assert burr.angle_deg.sigma * np.radians(scene.radius_mm) == pytest.approx(pixel_mm, rel=0.2)
    assert burr.length_mm.value == pytest.approx(14.0, abs=2.0 * pixel_mm)
    assert burr.z_start_mm.value == pytest.approx(place[2] - 2.5, abs=1.5 * pixel_mm)
    assert burr.z_end_mm.value == pytest.approx(place[2], abs=1.5 * pixel_mm)
    assert burr.width_mm.value == pytest.approx(2.5, abs=1.5 * pixel_mm)
    assert burr.height_mm.value == pytest.approx(0.55 * 2.5, abs=pixel_mm)
    assert burr.height_mm.sigma > 0.4 * burr.height_mm.value  # one view does not tell
    assert 8.0 < burr.significance < 20.0  # of 57 pixels all odd, beside 114 of which none is: 13
    assert np.linalg.norm(burr.T_mesh_burr[:3, 3] - scene.place_mm(-25.0, HALF_LENGTH_MM - 1.25)) < 1.5
    tangent = np.cross(scene.axis.direction, burr.T_mesh_burr[:3, 3] - scene.axis.point_mm)
    assert abs(burr.T_mesh_burr[:3, 0] @ tangent) == pytest.approx(np.linalg.norm(tangent))


def test_two_burrs_are_two_and_the_unit_of_light_is_any() -> None:
    scene = Scene()
    _burr(scene, -40.0, 12.0)
    _burr(scene, -10.0, 12.0)
    found = _called(scene)
    assert len(found) == 2
    assert [burr.angle_deg for burr in _called(scene, unit=1e-4)] == [burr.angle_deg for burr in found]


@pytest.mark.parametrize("seed", range(6))
def test_clean_edges_show_nothing(seed: int) -> None:
    assert not _called(Scene(seed=seed, direction=_TILTED if seed % 2 else (0.0, 1.0, 0.0)))


def _dark_alone(scene: Scene) -> None:
    scene.log_light[_stretch(scene, -25.0, 14.0)] -= 0.8


def _odd_alone(scene: Scene) -> None:
    scene.lost |= _stretch(scene, -25.0, 14.0)


def _along_the_axis(scene: Scene) -> None:
    """A stain, a shadow or a burr that crosses the edge."""
    cells = scene.band(-25.0, 14.0, 30.0, HALF_LENGTH_MM)
    scene.log_light[cells] -= 0.8
    scene.lost |= cells & (np.random.default_rng(7).random(cells.shape) < 0.66)


def _short(scene: Scene) -> None:
    _burr(scene, -25.0, 4.0)


def _slow(scene: Scene) -> None:
    """Light that fades in and out, as mirror images of other surfaces do."""
    cells = scene.band(-25.0, 60.0, HALF_LENGTH_MM - 2.5, HALF_LENGTH_MM)
    scene.log_light[cells] -= 0.4 * (1.0 + np.cos(np.pi * (scene.around[cells] + 25.0) / 30.0))
    scene.lost |= cells & (np.random.default_rng(7).random(cells.shape) < 0.66)


def _one_end(scene: Scene) -> None:
    """Dark from one place on, as behind the border of a shadow."""
    cells = scene.band(60.0, 170.0, HALF_LENGTH_MM - 2.5, HALF_LENGTH_MM)
    scene.log_light[cells] -= 0.8
    scene.lost |= cells & (np.random.default_rng(7).random(cells.shape) < 0.66)


def _few_odd(scene: Scene) -> None:
    """A quarter of the depths are lost: by so few pixels that it may be chance."""
    cells = _stretch(scene, -25.0, 14.0)
    scene.log_light[cells] -= 0.8
    scene.lost |= cells & (np.random.default_rng(7).random(cells.shape) < 0.3)


def _in_shadow(scene: Scene) -> None:
    """Hardly any light, by noise, and no depths."""
    cells = scene.band(-20.0, 70.0, 30.0, HALF_LENGTH_MM)
    scene.log_light[cells] = -6.0 + 0.3 * np.random.default_rng(5).normal(size=int(cells.sum()))
    _burr(scene)


def _longer_than_a_lobe(scene: Scene) -> None:
    """Over 65 degrees."""
    _burr(scene, 0.0, 102.0)


def _out_of_sight(scene: Scene) -> None:
    """Where the edge turns away."""
    _burr(scene, -60.0)


@pytest.mark.parametrize(
    "what",
    [
        _dark_alone,
        _odd_alone,
        _along_the_axis,
        _short,
        _slow,
        _one_end,
        _few_odd,
        _in_shadow,
        _out_of_sight,
        _longer_than_a_lobe,
    ],
)
def test_what_is_no_burr_along_an_edge_is_not_called(what: object) -> None:
    scene = Scene()
    what(scene)  # type: ignore[operator]
    assert not _called(scene)


def test_the_glint_of_a_rounding_is_none() -> None:
    """A bright stretch with odd depths where a rounding mirrors the projector, and the same elsewhere."""
    scene = Scene()
    foot, d = scene.axis.point_mm, scene.axis.direction
    ways = [place - foot for place in (np.zeros(3), scene.sight().rig.projector_centre_mm)]
    across = [way - (way @ d) * d for way in ways]
    half_way = sum(way / np.linalg.norm(way) for way in across)
    around = scene.radius_mm * np.arctan2(half_way @ scene._side, half_way @ scene._front)
    _burr(scene, float(around), 16.0, log_light=0.8)
    assert not _called(scene)
    elsewhere = Scene()
    _burr(elsewhere, float(around) - 35.0, 16.0, log_light=0.8)
    assert len(_called(elsewhere)) == 1


def test_what_models_of_light_are_not_good_to_is_no_change() -> None:
    for log_light, number in ((-0.08, 0), (-0.3, 1)):
        scene = Scene(light_noise=0.001)
        _burr(scene, log_light=log_light)
        assert len(_called(scene)) == number


def test_half_of_the_depths_may_be_the_edges() -> None:
    scene = Scene()
    cells = _stretch(scene, -25.0, 30.0)
    scene.log_light[cells] -= 0.8
    scene.lost |= cells & (np.random.default_rng(7).random(cells.shape) < 0.6)
    assert len(_called(scene)) == 1


@pytest.mark.parametrize("side", ["protrusion", "nick"])
def test_what_is_called_already_is_not_called_again(side: Side) -> None:
    scene = Scene()
    _burr(scene)
    (burr,) = _called(scene)
    assert not _called(scene, replace(burr, side=side))
    for around_mm, along_mm in ((40.0, HALF_LENGTH_MM), (-25.0, -HALF_LENGTH_MM)):
        pose = np.array(burr.T_mesh_burr)
        pose[:3, 3] = scene.place_mm(around_mm, along_mm)
        z = float(scene.in_part(pose[:3, 3])[2])
        there = replace(burr, T_mesh_burr=pose, z_start_mm=Value(z - 1.0, 0.1), z_end_mm=Value(z + 1.0, 0.1))
        assert len(_called(scene, there)) == 1


@pytest.mark.parametrize("number", [0, 1])
def test_the_default_burr_stage_calls_it_once_where_depth_shows_nothing(number: int) -> None:
    """With the part's mesh; of several views others will see it."""
    for several_views in (False, True):
        scene = Scene()
        if number:
            cells = _stretch(scene, -25.0, 14.0)
            scene.log_light[cells] -= 0.8
            scene.lost |= cells
        found = burrs_of(scene, seen=True, several_views=several_views)
        assert [one.side for one in found] == ["protrusion"] * (0 if several_views else number)
        for one in found:
            assert np.linalg.norm(one.T_mesh_burr[:3, 3] - scene.place_mm(-25.0, HALF_LENGTH_MM - 1.25)) < 1.5
