"""Meshing: orientation, jumps in depth, specks and spikes."""

from dataclasses import replace

import numpy as np
import pytest

from burrscan.arrays import Floats
from burrscan.correspondence import Correspondence
from burrscan.meshing import _agrees_with_neighbours, _whole, surface
from burrscan.rig import Rig
from burrscan.triangulation import camera_rays
from tests.burrscan.instrument import plane_depth, small_rig


def scene(rig: Rig, depth: Floats, *, sigma_px: float = 0.02, seed: int = 3) -> Correspondence:
    u = rig.correspond(camera_rays(rig.camera) * depth[..., None])[..., 0]
    u = u + np.random.default_rng(seed).normal(0.0, sigma_px, u.shape)
    mask = np.isfinite(u)
    return Correspondence(u.astype(np.float32), np.full(u.shape, sigma_px, np.float32), mask)


def lit(*, width: int = 160) -> Rig:
    """The small rig with a projector that lights all that its camera sees."""
    rig = small_rig(width=width)
    one = rig.projector
    wide = replace(
        one, width=3 * one.width, height=3 * one.height, cx=one.cx + one.width, cy=one.cy + one.height
    )
    return replace(rig, projector=wide)


def test_a_plane_is_one_sheet_that_faces_the_camera() -> None:
    rig = lit()
    found = surface(scene(rig, plane_depth(camera_rays(rig.camera))), rig)
    rows, columns = rig.camera.shape
    assert found.mask.mean() > 0.995
    assert len(found.faces) > 0.99 * 2 * (rows - 1) * (columns - 1)
    corners = found.vertices_mm[found.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("ij,ij->i", normals, corners[:, 0]) < 0.0).all()
    np.testing.assert_array_equal(found.points_mm[tuple(found.pixels.T)], found.vertices_mm)


def test_no_face_spans_a_step() -> None:
    rig = lit()
    depth = plane_depth(camera_rays(rig.camera))
    depth[:, 80:] += 60.0
    found = surface(scene(rig, depth), rig)
    columns = found.pixels[found.faces][..., 1]
    assert not ((columns.min(axis=1) < 80) & (columns.max(axis=1) >= 80)).any()
    assert found.mask.mean() > 0.98


def test_a_spike_and_a_speck_are_dropped() -> None:
    rig = lit()
    depth = plane_depth(camera_rays(rig.camera))
    depth[40, 40] += 8.0
    depth[90:105, 90:105] = np.nan
    depth[96:99, 96:99] = 640.0
    found = surface(scene(rig, depth), rig)
    assert not found.mask[40, 40]
    assert not found.mask[90:105, 90:105].any()


@pytest.mark.parametrize("width", [160, 60])
def test_what_the_border_of_the_projectors_picture_crosses_is_dropped(width: int) -> None:
    """On either side of it, and by a pixel of the camera where that is the larger, as here with 60."""
    rig = replace(small_rig(), camera=small_rig(width=width).camera)
    depth = plane_depth(camera_rays(rig.camera))
    found = surface(scene(rig, depth), rig)
    points = camera_rays(rig.camera) * depth[..., None]
    shape = np.array(rig.projector.shape[::-1])
    from_border = np.minimum(rig.correspond(points) + 0.5, shape - 0.5 - rig.correspond(points)).min(axis=-1)
    beside = np.linalg.norm(points - rig.projector_centre_mm, axis=-1)
    pixel = np.maximum(1.0, depth / rig.camera.fx * rig.projector.fx / beside)
    assert np.count_nonzero(from_border < 0.0) > 20
    assert not found.mask[from_border < 0.9 * pixel].any()
    assert found.mask[from_border > 1.2 * pixel].all()


def test_the_criterion_has_no_scale() -> None:
    small, large = lit(width=80), lit(width=240)
    shares = []
    for rig in (small, large):
        depth = plane_depth(camera_rays(rig.camera), tilt=1.5)
        shares.append(surface(scene(rig, depth, sigma_px=1e-4), rig).mask.mean())
    assert min(shares) > 0.97


@pytest.mark.parametrize(
    ("across", "down", "whole"),
    [(0.9, 0.0, True), (0.0, 0.9, True), (1.1, 0.0, False), (0.6, 0.6, True), (0.72, 0.72, False)],
)
def test_a_triangles_long_side_may_rise_by_the_root_of_two_more(
    *, across: float, down: float, whole: bool
) -> None:
    """Depths rise by so many permitted steps from pixel to pixel; both steps add up along the diagonal."""
    reach, near = 0.01, 500.0
    depth = near + near * reach * (across * np.arange(2.0) + down * np.arange(2.0)[:, None])
    # top left, bottom left, bottom right: the diagonal is their long side
    assert _whole(depth, np.zeros((2, 2)), (0, 0), (0, 1, 2), reach) == whole


def test_the_radiance_takes_the_points_to_the_pixels_centres() -> None:
    rig = lit(width=80)
    truth = plane_depth(camera_rays(rig.camera))
    there = scene(rig, truth, sigma_px=1e-3)
    # dark to the left of a fifth of column 40, five times as bright to the right of it: at 0.2 of the pixel
    light = np.where(np.arange(80) < 40, 1.0, 5.0) * np.ones(rig.camera.shape)
    light[:, 40] = 0.2 * 1.0 + 0.8 * 5.0
    centroid = (0.2 * -0.4 * 1.0 + 0.8 * 0.1 * 5.0) / light[0, 40]
    u_px = there.u_px.copy()
    u_px[:, 40] += centroid * np.gradient(there.u_px, axis=1)[:, 40]
    off = replace(there, u_px=u_px.astype(np.float32))
    plain, moved = (
        surface(off, rig, radiance=each).points_mm[5:-5, 40, 2] for each in (None, light.astype(np.float32))
    )
    bias, rest = (np.sqrt(np.nanmean((z - truth[5:-5, 40]) ** 2)) for z in (plain, moved))
    assert rest < 0.5 * bias


def test_an_empty_scan_gives_an_empty_mesh() -> None:
    rig = lit(width=80)
    found = surface(scene(rig, np.full(rig.camera.shape, np.nan)), rig)
    assert len(found.faces) == 0
    assert len(found.vertices_mm) == 0


def test_the_fast_plane_test_equals_plain_least_squares() -> None:
    rig = lit(width=48)
    depth = plane_depth(camera_rays(rig.camera), tilt=1.2)
    depth[:, 30:] += 25.0
    rng = np.random.default_rng(8)
    depth += rng.normal(0.0, 0.1, depth.shape) + 3.0 * (rng.uniform(size=depth.shape) < 0.05)
    depth[rng.uniform(size=depth.shape) < 0.1] = np.nan
    sigma = rng.uniform(0.05, 0.2, depth.shape)
    reach, z = 0.02, 5.0
    found = _agrees_with_neighbours(depth, sigma**2, reach, z)
    plain = np.array([[agrees(depth, sigma, r, c, reach, z) for c in range(48)] for r in range(len(depth))])
    assert 0.5 < plain.mean() < 0.95
    np.testing.assert_array_equal(found, plain)


def agrees(depth: Floats, sigma: Floats, r: int, c: int, reach: float, z: float) -> bool:
    """The same criterion by ``lstsq``."""
    near = [
        (y - r, x - c)
        for y in range(max(r - 2, 0), min(r + 3, depth.shape[0]))
        for x in range(max(c - 2, 0), min(c + 3, depth.shape[1]))
        if (y, x) != (r, c)
        and abs(depth[y, x] - depth[r, c])
        <= reach * np.hypot(y - r, x - c) * min(depth[y, x], depth[r, c])
        + 3.0 * np.hypot(sigma[y, x], sigma[r, c])
    ]
    if len(near) < 6:
        return False
    rows = np.array([(1.0, x, y) for y, x in near])
    zs = np.array([depth[r + y, c + x] - depth[r, c] for y, x in near])
    plane, _, rank, _ = np.linalg.lstsq(rows, zs, rcond=None)
    scatter = ((zs - rows @ plane) ** 2).sum() / max(len(near) - 3, 1)
    stated = np.mean([sigma[r + y, c + x] ** 2 for y, x in near])
    spread = max(scatter, stated) * (1.0 + np.linalg.pinv(rows.T @ rows)[0, 0])
    return bool(rank == 3 and plane[0] ** 2 <= z * z * (sigma[r, c] ** 2 + spread))
