"""Meshes as drawings have them, with vertices at their edges only."""

import numpy as np
import pytest
import trimesh

from bench.synthetic.revolution import axis_angle_deg, profile_of, random_pose, revolution_scan
from burrscan import inspect_mesh
from burrscan.axis import find_axis
from burrscan.axis.points.subdivide import COARSE, TARGET, subdivided
from tests.tiers import some_of


@pytest.mark.parametrize("sections", [24, 200])
@some_of("name", ["stepped_wheel", "cylinder", "flanged_hub", "cone"], first=2)
def test_a_drawing_s_axis_is_found_and_determined(name: str, sections: int) -> None:
    outline = profile_of(name)[:, ::-1]
    closed = np.vstack([[0.0, outline[0, 1]], outline, [0.0, outline[-1, 1]]])
    part = trimesh.creation.revolve(closed, sections=sections)
    pose = random_pose(np.random.default_rng(sections))
    axis = find_axis(part.vertices @ pose[:3, :3].T + pose[:3, 3], np.asarray(part.faces, np.int32))
    assert axis.undetermined == ()
    assert axis_angle_deg(axis.direction, pose[:3, 2]) < 0.01
    assert np.linalg.norm(np.cross(axis.point_mm - pose[:3, 3], pose[:3, 2])) < 0.02


@pytest.mark.study
def test_a_box_is_looked_at_without_complaint() -> None:
    box = trimesh.creation.box((1.0, 2.0, 3.0)).subdivide().subdivide()
    found = inspect_mesh(box.vertices, np.asarray(box.faces, np.int32))
    assert not all(check.passed for check in found.checks)


def test_faces_are_cut_until_they_are_small_and_cover_the_same_surface() -> None:
    box = trimesh.creation.box((1.0, 0.3, 2.0))
    points, faces = subdivided(box.vertices, np.asarray(box.faces, np.int32))
    np.testing.assert_array_equal(points[:8], box.vertices)
    fine = trimesh.Trimesh(points, faces, process=False)
    assert fine.edges_unique_length.max() <= TARGET
    assert fine.area == pytest.approx(box.area)
    assert fine.volume == pytest.approx(box.volume)  # so their senses are as they were


def test_a_scan_stays_as_it_is() -> None:
    scan = revolution_scan(shape=(160, 80), sigma_mm=0.2)
    points = scan.vertices_mm / np.linalg.norm(np.ptp(scan.vertices_mm, axis=0)) * 2.0
    same, faces = subdivided(points, scan.faces)
    assert same is points
    assert faces is scan.faces
    assert np.median(np.linalg.norm(points[faces[:, 0]] - points[faces[:, 1]], axis=1)) < COARSE


@pytest.mark.parametrize(("arc_deg", "far_mm"), [(60.0, 5.0), (140.0, 60.0)])
def test_the_long_faces_of_a_scan_s_spikes_make_no_drawing(arc_deg: float, far_mm: float) -> None:
    """Their area is many times that of the surface: cut into points, as a drawing's, they led 20° astray."""
    scan = revolution_scan(arc_deg=arc_deg, shape=(206, 128), sigma_mm=0.2, seed=3)
    rng = np.random.default_rng(5)
    spikes = rng.random(len(scan.vertices_mm)) < 0.05
    vertices = scan.vertices_mm + far_mm * spikes[:, None] * rng.normal(size=scan.vertices_mm.shape)
    axis = find_axis(vertices, scan.faces)
    assert scan.angle_error_deg(axis.direction) < 0.3
