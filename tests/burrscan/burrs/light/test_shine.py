"""How much a part shines, told by formulas of a matt and of a mirroring surface."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest

from burrscan.burrs.light.disturbed import disturbed
from burrscan.burrs.light.shine import MIRRORED, mirrored, walls_share
from burrscan.inspection import Burr, Value
from tests.burrscan.burrs.light.scene import Scene


def share_of(scene: Scene) -> float:
    surface, looks, _ = disturbed(scene.sight(), scene.axis, scene.generatrix, widest_mm=3.0)
    return MIRRORED * mirrored(looks, surface)


def test_a_matt_part_shines_little() -> None:
    """Its light falls with the cosine of the incidence: 30 degrees beside the middle by a quarter."""
    scene = Scene()
    turn = np.clip(scene.around / scene.radius_mm, -1.5, 1.5)
    scene.log_light = np.log(np.cos(turn))
    assert share_of(scene) < 0.08


@pytest.mark.parametrize("width_deg", [4.0, 10.0])
def test_metal_shines(width_deg: float) -> None:
    scene = Scene()
    scene.log_light = 3.0 - 0.5 * ((scene.around - 12.0) / np.radians(width_deg) / scene.radius_mm) ** 2
    assert share_of(scene) == pytest.approx(0.2, abs=0.02)


def test_what_is_not_seen_does_not_shine() -> None:
    scene = Scene()
    scene.log_light = np.full_like(scene.log_light, np.nan)
    assert share_of(scene) == 0.0


@pytest.mark.parametrize("depth_mm", [0.3, 1.0, 2.5])
def test_walls_send_each_other_the_light_that_rays_meet(depth_mm: float) -> None:
    """Rays from all over one wall of a V, evenly in the cosine: those that meet the other, to 4 sigma."""
    rng, rays, half = np.random.default_rng(1), 200_000, 0.75
    wall = np.array([half, depth_mm]) / np.hypot(half, depth_mm)  # from the bottom up, (x, y)
    normal = np.array([-wall[1], wall[0]])
    start = rng.uniform(0.0, np.hypot(half, depth_mm), (rays, 1)) * wall
    sine, turn = np.sqrt(rng.uniform(size=rays)), rng.uniform(0.0, 2.0 * np.pi, rays)
    way = np.sqrt(1.0 - sine**2)[:, None] * normal + (sine * np.cos(turn))[:, None] * wall
    other = np.array([-wall[0], wall[1]])
    det = way[:, 0] * -other[1] + way[:, 1] * other[0]
    at = (way[:, 0] * -start[:, 1] + way[:, 1] * start[:, 0]) / det
    along = (other[1] * start[:, 0] - other[0] * start[:, 1]) / det
    met = np.mean((along > 0.0) & (at > 0.0) & (at < np.hypot(half, depth_mm)))
    burr = ridge(half, depth_mm, "nick")
    assert walls_share(burr) == pytest.approx(met, abs=4.0 * 0.5 / np.sqrt(rays))
    assert walls_share(ridge(half, depth_mm, "protrusion")) == 0.0


def ridge(half_mm: float, height_mm: float, side: Literal["nick", "protrusion"]) -> Burr:
    one = Value(1.0, 0.1)
    return Burr(
        side=side, angle_deg=one, z_start_mm=one, z_end_mm=one, height_mm=Value(height_mm, 0.01),
        width_mm=Value(2.0 * half_mm, 0.01), length_mm=one, area_mm2=one, volume_mm3=one,
        T_mesh_burr=np.eye(4), significance=9.0,
    )  # fmt: skip
