"""What the page's rows without a figure are measured with, against independent truth."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bench.reproduction.clocked import FRAME_MS, Clocked
from bench.reproduction.mean_corner import crossed
from bench.reproduction.other_shapes import conditions, ring
from bench.reproduction.outliers import with_outliers
from bench.reproduction.photometry import Unknown, scan_unknown
from bench.reproduction.plane_scans import TILT_DEG, planes
from bench.reproduction.scenery import SCENES, TABLES, paper_scene
from bench.reproduction.symmetry import rises
from bench.synthetic.revolution import revolution_scan
from burrscan.scan.rivals.seed import scan_seed
from burrscan.scanner import Patterns
from scenes.scene import scene_from
from tests.bench.reproduction_lab import MadeUpLab
from tests.burrscan.instrument import Instrument, plane_depth, small_rig


def test_outliers_are_as_many_and_as_far_as_said() -> None:
    vertices = np.random.default_rng(1).normal(size=(40_000, 3)) + np.array([0.0, 0.0, 500.0])
    moved = with_outliers(vertices, 0.1, 30.0, seed=2) - vertices
    distance = np.linalg.norm(moved, axis=1)
    wrong = distance > 0.0
    assert wrong.mean() == pytest.approx(0.1, abs=4.0 * np.sqrt(0.09 / 40_000))
    assert np.sqrt((distance[wrong] ** 2).mean()) == pytest.approx(30.0, rel=4.0 / np.sqrt(2.0 * wrong.sum()))
    across = np.cross(moved, vertices / np.linalg.norm(vertices, axis=1)[:, None])
    assert np.abs(across).max() < 1e-9
    np.testing.assert_array_equal(with_outliers(vertices, 0.0, 30.0, seed=2), vertices)


def test_planes_meet_a_cone_where_its_radius_says() -> None:
    """Points lie in the planes, and on chords of the cone's rings."""
    scan = revolution_scan("cone", shape=(400, 31), sigma_mm=0.0)
    part = (scan.vertices_mm - scan.T_mesh_part[:3, 3]) @ scan.T_mesh_part[:3, :3]
    points, plane = crossed(part, scan.faces, np.eye(3), 7)
    low, high = part[:, 2].min(), part[:, 2].max()
    np.testing.assert_allclose(points[:, 2], low + plane * (high - low) / 7, atol=1e-9)
    radius = 85.0 + points[:, 2] / 2.0
    np.testing.assert_allclose(np.hypot(*points[:, :2].T), radius, atol=5e-3)
    assert set(plane) == set(range(1, 7))


def test_the_clock_adds_exposures_and_what_the_projector_needs() -> None:
    instrument = Instrument(small_rig(width=40), depth=plane_depth)
    height, width = instrument.rig.projector.shape
    shown = Patterns(np.zeros((3, height, width), np.uint8), ("a", "b", "c"))
    clocked = Clocked(instrument)
    clocked.capture(shown, 50.0)
    clocked.capture(shown, 1.0)
    assert clocked.shown_ms == pytest.approx(150.0 + 3.0 * FRAME_MS)
    assert clocked.rendering_s > 0.0


def test_an_unknown_curve_is_wrong_in_the_sheet_and_costs_accuracy() -> None:
    instrument = Instrument(small_rig(width=160), depth=plane_depth, noise=False)
    told = Unknown(instrument, camera=False, projector=True)
    assert told.projector.light[128] == pytest.approx(128.0 / 255.0)
    assert told.camera == instrument.camera
    errors = []
    for scan in (scan_seed(instrument), scan_unknown(instrument, projector=True)):
        known = scan.correspondence.mask
        errors.append(np.abs(scan.correspondence.u_px - instrument.truth_u)[known].mean())
    assert errors[0] != errors[1]


def test_f_rises_along_both_angles_and_a_turn_about_the_pole_changes_nothing(tmp_path: Path) -> None:
    scan = MadeUpLab(tmp_path, quick=True, code="made up").scan("wheel", "seed")
    flat = Rotation.align_vectors([[1.0, 1.0, 0.0]], [scan.direction])[0]
    lying = rises(scan, flat.as_matrix(), 30.0)
    assert min(lying) > 0.1
    spun = Rotation.from_euler("z", 20.0, degrees=True) * flat
    np.testing.assert_allclose(rises(scan, spun.as_matrix(), 30.0), lying, rtol=0.05)
    upright = Rotation.align_vectors([[0.0, 0.01, 1.0]], [scan.direction])[0]
    assert rises(scan, upright.as_matrix(), 30.0)[0] < 0.1 * min(lying)  # θ does nothing at the pole


@pytest.mark.parametrize("name", SCENES)
def test_the_pages_scenes_are_scenes_and_differ_as_said(name: str) -> None:
    scene = scene_from(paper_scene(name, scale=0.2), source=name)
    assert (scene.render.bounces == 1) == name.endswith("direct")
    assert bool(scene.camera.response.linear) == (name != "curved")
    assert (scene.channels == "rgb") == (name == "copper")
    assert set(TABLES) <= set(SCENES)


def test_a_ring_is_as_far_from_its_direction_as_said_and_goes_round() -> None:
    for direction in np.random.default_rng(3).normal(size=(20, 3)):
        unit = direction / np.linalg.norm(direction)
        tilted = np.array(ring(unit, 10.0))
        np.testing.assert_allclose(np.degrees(np.arccos(tilted @ unit)), 10.0, atol=1e-6)
        np.testing.assert_allclose(tilted.mean(axis=0), np.cos(np.radians(10.0)) * unit, atol=1e-9)
        assert len(np.unique(np.round(tilted, 9), axis=0)) == len(tilted)


def test_draws_of_a_condition_are_noise_about_one_axis(tmp_path: Path) -> None:
    for one in conditions(MadeUpLab(tmp_path, quick=True, code="made up")):
        (first, faces), (second, _) = one.drawn(0), one.drawn(1)
        assert first.shape == second.shape
        apart = np.linalg.norm(first - second, axis=1)
        assert np.sqrt((apart**2).mean()) == pytest.approx(np.sqrt(2.0) * one.noise_mm, rel=0.1)
        assert np.linalg.norm(one.direction) == pytest.approx(1.0)
        assert faces.max() < len(first)


def test_further_planes_differ_and_are_scenes() -> None:
    changes = planes(20)
    assert len({str(change) for change in changes}) == 20
    for change in changes[:3]:
        scene = scene_from(paper_scene("plane", scale=0.2, changed=change), source="plane")
        assert scene.pose.elevation_deg == change["pose"]["elevation_deg"]
        assert abs(scene.pose.elevation_deg - 90.0) <= TILT_DEG
    plain = paper_scene("plane", scale=0.2)
    assert paper_scene("plane", scale=0.2, changed={}) == plain
    assert plain["wheel"] == paper_scene("plane", scale=0.2, changed=changes[0])["wheel"]
