"""How much a part shines, told by formulas of a matt and of a mirroring surface."""

from __future__ import annotations

import numpy as np
import pytest

from burrscan.burrs.light.disturbed import disturbed
from burrscan.burrs.light.shine import mirrored_share
from tests.burrscan.burrs.light.scene import Scene


def share_of(scene: Scene) -> float:
    surface, looks, _ = disturbed(scene.sight(), scene.axis, scene.generatrix, widest_mm=3.0)
    return mirrored_share(looks, surface)


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
