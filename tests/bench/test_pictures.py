"""The sheet of close-ups: every tile looks at something that is there, in its middle."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from bench.pictures.__main__ import _zoomed
from bench.pictures.tiles import TILES, Tile
from scenes.scene import SceneSpec, load_scene
from scenes.simulate import optics_of
from scenes.surface import true_blemishes
from scenes.wheel import Wheel, build_wheel
from tests.test_project import ROOT


@lru_cache
def built(name: str) -> tuple[SceneSpec, Wheel]:
    """A scene that several tiles show, and its wheel."""
    scene = load_scene(name)
    return scene, build_wheel(scene.wheel, scene.burrs, facet_error_mm=0.05)


@pytest.mark.parametrize("tile", TILES, ids=lambda tile: tile.title)
def test_a_tile_looks_at_what_its_title_says(tile: Tile) -> None:
    scene, wheel = built(tile.scene)
    places = [
        (f"{burr.kind} {burr.section}", burr.angle_deg, burr.z_start_mm, burr.z_end_mm)
        for burr in wheel.burrs
    ] + [
        (blemish.kind.replace("_", " "), blemish.angle_deg, blemish.z_start_mm, blemish.z_end_mm)
        for blemish in true_blemishes(scene.blemish, wheel.generatrix_zr_mm)
    ]
    there = " ".join(
        kind
        for kind, angle, start, end in places
        if start - 2.0 <= tile.z_mm <= end + 2.0
        and abs((angle - tile.angle_deg + 180.0) % 360.0 - 180.0) < 1.0
    )
    word = tile.title.split()[0].strip(":,")
    if word == "zone":
        assert tile.z_mm in {end for zone in scene.zone for end in (zone.z_start_mm, zone.z_end_mm)}
    else:
        assert word in there


def test_the_longer_lens_shows_the_place_in_the_middle_and_as_wide_as_said() -> None:
    optics = optics_of(load_scene("paper"))
    middle = np.array([30.0, -12.0, 520.0])
    camera = _zoomed(optics, middle, 20.0).rig.camera
    edge = middle + np.array([10.0, 0.0, 0.0])
    columns = [camera.fx * x / z + camera.cx for x, _, z in (middle, edge)]
    assert columns[0] == pytest.approx((camera.width - 1) / 2.0)
    assert columns[1] == pytest.approx(camera.width - 0.5)
    assert camera.fy * middle[1] / middle[2] + camera.cy == pytest.approx((camera.height - 1) / 2.0)


def test_the_sheet_is_small_enough_to_be_kept() -> None:
    assert (ROOT / "docs" / "families.jpg").stat().st_size < 300_000
