"""What camera or projector only graze tells nothing, whatever depth was measured there."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from burrscan.arrays import Floats
from burrscan.axis.basis import T_part_mesh
from burrscan.burrs import residual
from burrscan.burrs.field import Field
from burrscan.burrs.grazed import FLATTEST, facing
from tests.burrscan.burrs.light.scene import UPRIGHT, Scene, burrs_of
from tests.burrscan.burrs.light.test_told_by_light import angle_at

RADIUS_MM = 50.0


def cylinder(*angles_deg: float) -> Field:
    """Feet on a cylinder at z = 0."""
    angle = np.radians(angles_deg)
    foot, normal = np.tile([0.0, RADIUS_MM], (len(angle), 1)), np.tile([0.0, 1.0], (len(angle), 1))
    return cast(Field, SimpleNamespace(angle=angle, foot=foot, normal=normal))


def at(angle_deg: float, distance_mm: float = 700.0) -> Floats:
    angle = np.radians(angle_deg)
    return distance_mm * np.array([np.cos(angle), np.sin(angle), 0.0])


@pytest.mark.parametrize("turn", [0.0, 35.0, -80.0])
def test_it_is_the_cosine_at_which_the_more_oblique_one_looks(turn: float) -> None:
    camera, projector = at(turn), at(turn + 20.0)
    # law of cosines: from a place 40 degrees from the one and 60 from the other
    expected = [
        (700.0 * np.cos(t) - RADIUS_MM) / np.sqrt(700.0**2 + RADIUS_MM**2 - 1400.0 * RADIUS_MM * np.cos(t))
        for t in np.radians([40.0, 60.0])
    ]
    both = np.stack([camera, projector])
    assert facing(cylinder(turn - 40.0), np.array([0]), both) == pytest.approx(expected[1])
    assert facing(cylinder(turn - 40.0), np.array([0]), both[:1]) == pytest.approx(expected[0])
    assert facing(cylinder(turn - 40.0), np.array([0]), both[::-1]) == pytest.approx(expected[1])


def test_it_is_the_median_of_those_asked_and_negative_behind() -> None:
    both = np.stack([at(0.0), at(0.0)])
    field = cylinder(10.0, 80.0, 120.0, 130.0)
    assert facing(field, np.array([1, 2, 3]), both) == facing(field, np.array([2]), both) < 0.0
    assert facing(field, np.array([0]), both) > 0.95


@pytest.mark.parametrize("direction", [UPRIGHT, (0.2, 0.9, -0.2)])
def test_both_centres_are_where_the_part_frame_has_them(direction: tuple[float, float, float]) -> None:
    scene = Scene(direction)
    centres = np.stack([np.zeros(3), scene.rig.projector_centre_mm])
    expected = [scene.in_part(centre) for centre in centres]
    T = T_part_mesh(scene.axis.point_mm, scene.axis.direction)
    np.testing.assert_allclose(scene.rig.centres_mm(T), expected, atol=1e-9)


def cosine(scene: Scene, around_mm: float) -> float:
    """At which the more oblique of camera and projector meets a place of a scene."""
    place = scene.place_mm(around_mm, 0.0)
    normal = place - np.asarray(scene.middle_mm)
    towards = (-place, scene.rig.projector_centre_mm - place)
    return min(float(normal @ way / np.linalg.norm(normal) / np.linalg.norm(way)) for way in towards)


def test_at_the_border_of_the_light_nothing_is_called(monkeypatch: pytest.MonkeyPatch) -> None:
    """What bounced is all that is decoded there; as far from it as nicks were seen, a ridge is one."""
    grid = np.arange(-140.0, 140.0, 1.0)
    scene = Scene()
    edge = min((around for around in grid if 0.04 < cosine(scene, around) < 0.12), key=abs)
    inwards = next(a for a in (edge + np.sign(-edge) * np.arange(60.0)) if cosine(scene, a) > FLATTEST + 0.1)
    for around, expected in ((edge, 0), (inwards, 1)):
        scene = Scene()
        scene.lift_mm[scene.band(around, 5.0, -15.0, 12.0)] += 1.2
        assert len(burrs_of(scene, seen=False)) == 1
        found = burrs_of(scene, seen=True)
        assert len(found) == expected
        if found:
            assert found[0].angle_deg.value == pytest.approx(angle_at(scene, around, -1.5), abs=3.0)
    scene = Scene()
    scene.lift_mm[scene.band(edge, 5.0, -15.0, 12.0)] += 1.2
    monkeypatch.setattr(residual, "FLATTEST", -1.0)
    assert len(burrs_of(scene, seen=True)) == 1
