"""What light paths carry, path by path: against a plain loop that gathers nothing together.

Statistics of whole pictures do not see that a few per cent of the light of the third surface are missing.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import drjit as dr
import numpy as np
import pytest

from burrscan.arrays import Floats, Floats32
from scenes.finish import FinishSpec, finish_bsdf
from scenes.pose import PoseSpec
from scenes.rig import RigSpec
from scenes.transport.chance import Chance
from scenes.transport.optics import Optics
from scenes.transport.paths import first_surface, later_surfaces
from scenes.transport.profile import PixelProfile
from scenes.transport.rays import projected_light
from scenes.transport.trace import shares
from scenes.transport.turn import CELLS, STRIPS, Guided, turned
from scenes.transport.world import wheel_mesh
from scenes.wheel import build_wheel, load_wheel
from tests.tiers import some_of

_PATHS = 1 << 17


class Given:
    """Paths whose numbers, (turns, 3, paths), and guide, or none, are chosen here."""

    def __init__(self, mi: Any, numbers: Floats, guide: Guided | None) -> None:
        self._mi, self._numbers, self._guide = mi, numbers, guide

    def uniform(self, turn: int, path: Any) -> tuple[Any, Any]:
        of = [self._mi.Float(row.astype(np.float32)) for row in self._numbers[turn]]
        choice, across, up = (dr.gather(self._mi.Float, row, path) for row in of)
        return choice, self._mi.Point2f(across, up)

    def guided(self, _turn: int, _path: Any) -> Guided | None:
        return self._guide


class Seen(NamedTuple):
    """A grooved wheel and what the camera sees of it; a projector pixel has no blur to draw in."""

    scene: Any
    optics: Optics
    si: Any
    chance: Chance


@pytest.fixture(scope="module")
def seen(mi: Any) -> Seen:
    spec = RigSpec(scale=0.125)
    optics = replace(Optics(spec.rig(), spec.standoff_mm), profile=PixelProfile(blur_px=0.0))
    pose = PoseSpec(elevation_deg=12.0).T_camera_part(standoff_mm=spec.standoff_mm, middle_z_mm=0.0)
    wheel = build_wheel(load_wheel("grooved_pulley"), facet_error_mm=0.02)
    mesh = wheel_mesh(mi, wheel, pose, finish_bsdf(FinishSpec(alpha=0.25), channels="mono"))
    scene = mi.load_dict({"type": "scene", "wheel": mesh})
    rng, view = np.random.default_rng(0), optics.rig.camera
    column, row = (mi.Float(rng.uniform(0.3 * n, 0.7 * n, _PATHS)) for n in (view.width, view.height))
    chance = Chance(dr.arange(mi.UInt32, _PATHS), mi.UInt32(3))
    return Seen(scene, optics, first_surface(mi, scene, optics, column, row, None), chance)


def given(mi: Any, *, guided: bool) -> Given:
    rng = np.random.default_rng(1)
    return Given(mi, rng.random((2, 3, _PATHS)), some_guide(mi) if guided else None)


def some_guide(mi: Any) -> Guided:
    """A guide with no reason: uneven cells, a part of the way around the camera's direction."""
    rng = np.random.default_rng(2)
    across = np.sort(rng.uniform(-1.3, 1.1, STRIPS + 1))
    along = np.sort(rng.uniform(-1.2, 1.4, (STRIPS, CELLS + 1)), axis=1)
    tables = [mi.Float(table.ravel().astype(np.float32)) for table in (across, along)]
    frame = mi.Vector3f(0.0, -0.6, -0.8), mi.Vector3f(1.0, 0.0, 0.0)
    return Guided(mi.Bool(True), *frame, mi.UInt32(0), *tables)


def plainly(mi: Any, seen: Seen, paths: Given) -> Iterator[Floats32]:
    """Light of 2 and of 3 surfaces of every path."""
    si, throughput, every = seen.si, mi.Float(1.0), dr.arange(mi.UInt32, _PATHS)
    for turn in range(2):
        towards, weight = turned(
            mi, si, paths.guided(turn, every), *paths.uniform(turn, every), active=si.is_valid()
        )
        throughput = dr.select(si.is_valid(), throughput * weight, 0.0)
        si = seen.scene.ray_intersect(si.spawn_ray(towards), throughput > 0.0)
        lit = projected_light(mi, seen.scene, seen.optics, si, None, si.is_valid())
        yield dr.select(si.is_valid(), lit.weight * throughput, 0.0).numpy()


@some_of("guided", [True, False])
def test_paths_gathered_together_carry_what_each_would_alone(mi: Any, seen: Seen, *, guided: bool) -> None:
    paths = given(mi, guided=guided)
    ours = later_surfaces(mi, seen.scene, seen.optics, seen.si, seen.chance, 3, paths=paths).arrivals
    assert len(ours) == 2
    for arrival, alone in zip(ours, plainly(mi, seen, paths), strict=True):
        light = np.zeros(_PATHS)
        light[arrival.path.numpy()] = arrival.weight.numpy()
        assert (alone > 0.0).sum() > 500
        same = np.isclose(light, alone, rtol=1e-3, atol=0.0)
        assert same.mean() > 0.9995  # a ray that grazes an edge may go either way
        assert light.sum() == pytest.approx(alone.sum(), rel=2e-3)


def test_a_guide_does_not_change_what_a_surface_reflects(mi: Any, seen: Seen) -> None:
    """The mean weight of a turn is what the surface reflects of a uniform surround."""
    every, valid = dr.arange(mi.UInt32, _PATHS), seen.si.is_valid()
    weights = []
    for guided in (False, True):
        paths = given(mi, guided=guided)
        _, weight = turned(mi, seen.si, paths.guided(0, every), *paths.uniform(0, every), active=valid)
        weights.append(weight.numpy()[valid.numpy()].astype(float))
    plain, ours = weights
    error = np.sqrt((plain.var() + ours.var()) / plain.size)
    assert error < 0.005 * plain.mean()
    assert abs(ours.mean() - plain.mean()) < 4.0 * error


def test_every_refined_path_counts_once() -> None:
    """The shares of the rounds of a pixel are 1 together, and go by the number of paths."""
    refined = np.array([0, 64, 64 + 192])
    everyone, some, last = np.arange(3), np.array([1, 2]), np.array([2])
    parts = [(everyone, np.full(3, 16)), (some, np.full(2, 64)), (last, np.full(1, 192))]
    by_part = shares(parts, refined=refined, pilots=1)
    total = np.zeros(3)
    for (pixels, _), share in zip(parts, by_part, strict=True):
        total[pixels] += share
    assert total == pytest.approx(1.0)
    assert by_part[0].tolist() == [1.0, 0.0, 0.0]
    assert by_part[1][1] / by_part[2][0] == pytest.approx(64 / 192)
