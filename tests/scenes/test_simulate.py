"""The simulated scanner: its truth agrees with geometry, its fallback with the traced light."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from burrscan import Correspondence, InputError, Patterns, View
from burrscan.arrays import Floats32
from burrscan.triangulation import triangulate
from scenes.scene import SceneSpec, scene_from
from scenes.simulate import Simulation, simulate
from scenes.wheel import deviation_mm

DOCUMENT: dict[str, Any] = {
    "wheel": "stepped_hub",
    "finish": "ground",
    "pose": {"elevation_deg": 15.0, "spin_deg": 20.0},
    "rig": {"scale": 0.25},
    "burr": [
        {
            "kind": "axial_ridge",
            "angle_deg": -20,
            "height_mm": 2,
            "width_mm": 2,
            "z_start_mm": -8,
            "z_end_mm": 8,
        }
    ],
}


@pytest.fixture(scope="module")
def scene() -> SceneSpec:
    return scene_from(DOCUMENT, source="test")


@pytest.fixture(scope="module")
def simulation(scene: SceneSpec) -> Simulation:
    return simulate(scene)


def test_points_lie_on_the_wheel(simulation: Simulation) -> None:
    truth = simulation.truth
    body = truth.burr_index < 0
    seen = np.isfinite(truth.points_mm).all(axis=-1)
    off = deviation_mm(truth.points_part_mm[seen & body], truth.wheel.generatrix_zr_mm)
    assert np.abs(off).max() < 0.003
    on_burr = truth.points_part_mm[seen & ~body]
    assert len(on_burr) > 20
    heights = deviation_mm(on_burr, truth.wheel.generatrix_zr_mm)
    assert 1.0 < heights.max() < 2.003


def test_centre_and_response_agree_on_smooth_surface(simulation: Simulation) -> None:
    truth = simulation.truth
    smooth = truth.measurable & np.isfinite(truth.u_px) & (simulation.light.spread_px < 0.3)
    error = truth.u_px[smooth] - truth.u_response_px[smooth]
    assert smooth.sum() > 2000
    assert np.median(np.abs(error)) < 0.01


def test_true_correspondence_triangulates_to_the_true_points(simulation: Simulation) -> None:
    truth = simulation.truth
    known = np.isfinite(truth.u_px)
    points, _ = triangulate(Correspondence(truth.u_px, np.ones_like(truth.u_px), known), truth.rig)
    good = known & np.isfinite(points).all(axis=-1)
    assert good.sum() > 2000
    assert np.abs(points[good] - truth.points_mm[good]).max() < 0.01


def test_fresh_scanners_see_the_same(simulation: Simulation) -> None:
    white = Patterns(np.full((2, *simulation.truth.rig.projector.shape), 255, np.uint8), ("a", "b"))
    one, two = (simulation.scanner().capture(white, 5.0) for _ in range(2))
    assert np.array_equal(one, two)
    assert not np.array_equal(one[0], one[1])


def test_bad_requests_are_refused(simulation: Simulation) -> None:
    white = Patterns(np.full((1, *simulation.truth.rig.projector.shape), 255, np.uint8), ("a",))
    with pytest.raises(InputError, match="exposure"):
        simulation.scanner().capture(white, 1e4)
    with pytest.raises(InputError, match="do not fit"):
        simulation.scanner().capture(Patterns(white.frames[:, 1:], ("a",)), 5.0)


FALLBACK = """
import json, sys
import numpy as np
from scenes.scene import scene_from
from scenes.simulate import simulate
from tests.scenes.test_simulate import sine

simulation = simulate(scene_from(json.loads(sys.argv[1]), source="test"))
light, truth = simulation.light, simulation.truth
image = light.relight(sine(truth.rig.projector))[0]
np.savez(sys.argv[2], image=image, direct=light.white_direct, ambient=light.ambient, u=truth.u_px,
         measurable=truth.measurable)
"""


def sine(view: View) -> Floats32:
    wave = 0.5 + 0.5 * np.sin(np.arange(view.width) / 5.0)
    return np.broadcast_to(wave, view.shape)[None].astype(np.float32)


def test_the_scalar_fallback_renders_the_same_light(tmp_path: Path) -> None:
    """Without LLVM and CUDA: stock Mitsuba, one pattern at a time, the same picture within noise."""
    document = DOCUMENT | {"finish": "blasted", "rig": {"scale": 0.15}, "render": {"samples": 64}}
    environment = os.environ | {"BURRSCAN_VARIANT": "scalar_rgb"}
    command = [sys.executable, "-c", FALLBACK, json.dumps(document), str(tmp_path / "out.npz")]
    run = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)  # noqa: S603
    assert run.returncode == 0, run.stderr
    stock = np.load(tmp_path / "out.npz")
    ours = simulate(scene_from(document, source="test"))
    truth, light = ours.truth, ours.light
    assert stock["image"].mean() == pytest.approx(light.relight(sine(truth.rig.projector)).mean(), rel=0.01)
    assert stock["direct"].mean() == pytest.approx(light.white_direct.mean(), rel=0.005)
    assert stock["ambient"].mean() == pytest.approx(light.ambient.mean(), rel=0.01)
    both = np.isfinite(stock["u"]) & np.isfinite(truth.u_px)
    assert both.sum() > 1000
    assert np.abs(stock["u"] - truth.u_px)[both].max() < 0.01
    assert np.mean(stock["measurable"] == truth.measurable) > 0.98
