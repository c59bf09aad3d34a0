"""Shapes that leave an axis open are told from shapes that nearly do, whatever their mesh."""

import numpy as np
import pytest
import trimesh
from scipy import ndimage

from bench.synthetic.revolution import grid_faces, profile_of, revolution_scan
from burrscan.axis import find_axis
from tests.tiers import some_of


@some_of("count", [16, 32, 100], first=2)
@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_a_sphere_has_no_axis_though_its_mesh_has_poles(count: int, noise: float) -> None:
    mesh = trimesh.creation.uv_sphere(radius=50.0, count=[count, count])
    shaken = mesh.vertices + 50.0 * noise * np.random.default_rng(1).normal(size=mesh.vertices.shape)
    axis = find_axis(shaken, np.asarray(mesh.faces, np.int32))
    assert "direction" in axis.undetermined
    assert axis.sigma_deg > 45.0


@some_of("shape", [(120, 60), (242, 96)])
@pytest.mark.parametrize("profile", ["sphere", "plane"])
def test_noise_of_a_small_mesh_feigns_no_axis(profile: str, shape: tuple[int, int]) -> None:
    expected = {"sphere": "direction", "plane": "position"}[profile]
    for seed, arc_deg in enumerate((60.0, 140.0, 360.0, 360.0)):
        scan = revolution_scan(profile, arc_deg=arc_deg, shape=shape, sigma_mm=0.05, seed=seed)
        assert expected in find_axis(scan.vertices_mm, scan.faces).undetermined


def test_what_is_nearly_a_sphere_has_an_axis() -> None:
    """A spheroid longer by 0.5 %, 0.45 mm at σ = 0.05 mm: nine sigma at the poles, seen by 62,000 points."""
    scan = revolution_scan(profile_of("sphere") * [1.005, 1.0], arc_deg=360.0, sigma_mm=0.05, seed=2)
    axis = find_axis(scan.vertices_mm, scan.faces)
    assert axis.undetermined == ()
    assert scan.angle_error_deg(axis.direction) < 4.0 * axis.sigma_deg < 2.0


@some_of("reach", [4.0, 1.5, 10.0])
@pytest.mark.parametrize("shape", ["sphere", "plane"])
def test_noise_that_neighbours_share_feigns_no_axis(shape: str, reach: float) -> None:
    """A generatrix follows it, and so many points that err alike are no many witnesses."""
    expected = {"sphere": "direction", "plane": "position"}[shape]
    x, y = np.meshgrid(np.linspace(-50.0, 50.0, 120), np.linspace(-50.0, 50.0, 120))
    z = np.zeros_like(x) if shape == "plane" else np.sqrt(90.0**2 - x**2 - y**2)
    for seed in range(3):
        noise = ndimage.gaussian_filter(np.random.default_rng(seed).normal(size=x.shape), reach)
        points = np.stack([x, y, z + 0.05 * noise / noise.std()], axis=-1).reshape(-1, 3)
        assert expected in find_axis(points, grid_faces(120, 120)).undetermined


def test_a_rim_tells_where_the_axis_of_a_plate_lies() -> None:
    """A tenth of the points, rounded off over 2 mm: the others are a plane's."""
    turn = np.linspace(0.0, 0.5 * np.pi, 8)
    rim = np.stack([-2.0 * (1.0 - np.cos(turn)), 48.0 + 2.0 * np.sin(turn)], axis=1)
    scan = revolution_scan(
        np.concatenate([[[0.0, 8.0]], rim]), arc_deg=360.0, shape=(240, 120), sigma_mm=0.02, seed=4
    )
    axis = find_axis(scan.vertices_mm, scan.faces)
    assert axis.undetermined == ()
    middle = scan.point_mm + (scan.vertices_mm.mean(axis=0) - scan.point_mm) @ scan.direction * scan.direction
    off = np.linalg.norm(np.cross(middle - axis.point_mm, axis.direction))
    assert off < 4.0 * np.sqrt(np.trace(axis.covariance[2:, 2:])) < 0.1
