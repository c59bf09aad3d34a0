"""A fault planted in each stage of a real run shows up in the metric that should see it."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bench.score import Evidence, measure
from burrscan import Axis, Patterns
from burrscan.arrays import Floats, Image, Ints32
from burrscan.axis import find_axis
from burrscan.pipeline import Pipeline, Stage, run
from scenes.scanner import SimulatedScanner
from scenes.scene import scene_from
from scenes.simulate import Simulation, simulate

SCENE: dict[str, Any] = {
    "wheel": "paper",
    "finish": "matte",
    "rig": {"scale": 0.3125},
    "pose": {"elevation_deg": 6.0},
    "burr": [
        {
            "kind": "axial_ridge",
            "angle_deg": 8.0,
            "height_mm": 2.5,
            "width_mm": 3.0,
            "z_start_mm": -10.0,
            "z_end_mm": 12.0,
        }
    ],
}
TURNED_DEG = 1.5


class Faulty(SimulatedScanner):
    """A scanner that is told a shifted projector, or whose camera clips at a share of its range."""

    def __init__(self, simulation: Simulation, *, shift_px: float = 0.0, clip: float = 1.0) -> None:
        rig = simulation.truth.rig
        told = replace(rig, projector=replace(rig.projector, cx=rig.projector.cx + shift_px))
        super().__init__(simulation.light, scene=simulation.scene, rig=told, identity=simulation.identity)
        self._clip = clip

    def capture(self, patterns: Patterns, exposure_ms: float) -> Image:
        """Images whose bright values are stuck at the top."""
        images = super().capture(patterns, exposure_ms)
        top = self.camera.saturation_dn
        return np.where(images > self._clip * top, np.uint16(top), images)


def turned_axis(vertices_mm: Floats, faces: Ints32, *, sigma_mm: Floats | None = None) -> Axis:
    """The axis by the default method, turned by a planted angle."""
    axis = find_axis(vertices_mm, faces, sigma_mm=sigma_mm)
    across = np.cross(axis.direction, [0.0, 0.0, 1.0])
    turned = axis.direction + np.tan(np.radians(TURNED_DEG)) * across / np.linalg.norm(across)
    return replace(axis, direction=turned / np.linalg.norm(turned))


def missing_burrs(*_: Any, sigma_mm: Floats | None = None) -> tuple[()]:
    """A burr stage that sees nothing."""
    assert sigma_mm is not None
    return ()


@pytest.fixture(scope="module")
def simulation() -> Simulation:
    return simulate(scene_from(SCENE, source="test"))


def metrics(simulation: Simulation, pipeline: Pipeline, **fault: Any) -> dict[str, float]:
    return measure(Evidence(simulation.truth, run(Faulty(simulation, **fault), pipeline)))


FIXED = Pipeline(scan=Stage("fixed"))


@pytest.fixture(scope="module")
def sound(simulation: Simulation) -> dict[str, float]:
    return metrics(simulation, FIXED)


def test_the_sound_run_is_good(sound: dict[str, float]) -> None:
    assert sound["coverage"] > 0.95
    assert sound["saturated_share"] < 0.01
    assert sound["depth_rms_mm"] < 0.4
    assert sound["axis_deg"] < 0.2
    assert sound["burr_found"] == 1.0


def test_a_shifted_projector_shows_in_depth(simulation: Simulation, sound: dict[str, float]) -> None:
    shifted = metrics(simulation, FIXED, shift_px=2.0)
    assert shifted["depth_rms_mm"] > sound["depth_rms_mm"] + 1.0
    assert shifted["coverage"] == pytest.approx(sound["coverage"], abs=0.01)  # the images are as they were


def test_a_clipped_camera_shows_in_saturation(simulation: Simulation, sound: dict[str, float]) -> None:
    """A sheet that promises more range than the camera has: half of it is one stuck value."""
    clipped = metrics(simulation, FIXED, clip=0.5)
    assert clipped["saturated_share"] > sound["saturated_share"] + 0.3
    assert clipped["coverage"] < sound["coverage"] - 0.3


def test_a_rotated_axis_shows_in_the_axis(simulation: Simulation) -> None:
    pipeline = replace(FIXED, axis=Stage(f"{__name__}:turned_axis"))
    assert metrics(simulation, pipeline)["axis_deg"] == pytest.approx(TURNED_DEG, abs=0.2)


def test_a_blind_burr_stage_shows_in_found(simulation: Simulation) -> None:
    pipeline = replace(FIXED, burrs=Stage(f"{__name__}:missing_burrs"))
    assert metrics(simulation, pipeline)["burr_found"] == 0.0
