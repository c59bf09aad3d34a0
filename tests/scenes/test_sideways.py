"""A projector above or below its camera: light falls where its own raster has it, and scans see the wheel."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bench.score.evidence import Evidence
from bench.score.scan import coverage, wrong_rate
from burrscan import Patterns
from burrscan.captures.replay import replay
from burrscan.meshing import surface
from burrscan.pipeline import Pipeline, run
from burrscan.sideways import across_columns, quarter_turned
from scenes.capture_folder import write_capture
from scenes.scene import scene_from
from scenes.simulate import Simulation, simulate

DOCUMENT = {
    "wheel": "cylinder",
    "finish": "matte",
    "pose": {"elevation_deg": 12.0, "roll_deg": 70.0},
    "rig": {"scale": 0.12, "projector": {"width": 1024, "height": 768, "focal_px": 2048.0, "cx": 560.0}},
    "render": {"error": 0.1},
}


def document(azimuth_deg: float) -> dict[str, object]:
    return {**DOCUMENT, "rig": {**DOCUMENT["rig"], "baseline_azimuth_deg": azimuth_deg}}  # type: ignore[dict-item]


@pytest.fixture(scope="module", params=[90.0, 270.0], ids=["below", "above"])
def simulation(request: pytest.FixtureRequest) -> Simulation:
    return simulate(scene_from(document(request.param), source="test"))


def test_a_lit_corner_of_the_raster_lights_the_points_that_it_sees(simulation: Simulation) -> None:
    """By the rig as the scene has it, whose raster nobody has turned."""
    rig, truth = simulation.scene.rig.rig(), simulation.truth
    u, v = np.moveaxis(rig.correspond(truth.points_mm), -1, 0)
    column, row = (int(np.nanquantile(each[truth.lit], share)) for each, share in ((u, 0.4), (v, 0.6)))
    frames = np.zeros((2, *rig.projector.shape), np.uint8)
    frames[0] = 255
    frames[1, :row, :column] = 255
    scanner = simulation.scanner()
    assert scanner.rig.projector == rig.projector
    white, part = scanner.capture(Patterns(frames, ("white", "part")), 10.0).astype(float)
    bright = truth.lit & (white > 0.3 * np.nanmax(white)) & np.isfinite(u)
    inside = (u < column - 2) & (v < row - 2)
    outside = (u > column + 2) | (v > row + 2)
    share = part / white
    assert (bright & inside).sum() > 50
    assert (bright & outside).sum() > 500
    assert np.quantile(share[bright & inside], 0.05) > 0.9
    # what is left is interreflected, and the black level
    assert np.quantile(share[bright & outside], 0.95) < 0.3


def test_it_is_scanned_as_well_as_from_aside(simulation: Simulation) -> None:
    aside = simulate(scene_from(document(0.0) | {"pose": {"elevation_deg": 12.0}}, source="test"))
    looked = [Evidence(each.truth, run(each.scanner(), Pipeline())) for each in (simulation, aside)]
    ours, theirs = (coverage(each) for each in looked)
    assert ours > 0.97
    assert ours > theirs - 0.02
    assert wrong_rate(looked[0]) < 0.01
    assert abs(np.nanmedian(looked[0].depth_error_mm)) < 0.02


def test_its_capture_folder_is_scanned(tmp_path: Path) -> None:
    scene = scene_from(document(90.0), source="test")
    folder = write_capture(scene, tmp_path / "capture")
    scan, scanner = replay(folder)
    assert scanner.rig.projector.shape == scene.rig.rig().projector.shape
    told = quarter_turned(scanner.rig)
    assert across_columns(scanner.rig).projector == told.projector
    found = surface(scan.correspondence, told, radiance=scan.radiance)
    truth = np.load(folder / "truth.npz")["points_mm"]
    off = np.abs(found.points_mm[..., 2] - truth[..., 2])
    assert np.isfinite(off).sum() > 0.5 * np.isfinite(truth[..., 2]).sum()
    assert np.nanquantile(off, 0.9) < 0.3
