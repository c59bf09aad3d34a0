"""Triangulation against analytic geometry."""

from collections.abc import Callable

import numpy as np
import pytest

from burrscan.arrays import Floats
from burrscan.correspondence import Correspondence
from burrscan.triangulation import camera_rays, epipolar_v, triangulate
from tests.burrscan.instrument import cylinder_depth, plane_depth, small_rig

LENS = (-0.12, 0.03, 0.001, -0.0005, 0.01)


def exact(depth: Floats, rig_uv: Floats, sigma_px: float = 0.05) -> Correspondence:
    mask = np.isfinite(rig_uv[..., 0])
    sigma = np.where(mask, sigma_px, np.nan).astype(np.float32)
    assert depth.shape == mask.shape
    return Correspondence(rig_uv[..., 0].astype(np.float32), sigma, mask)


@pytest.mark.parametrize("lens", [(0.0,) * 5, LENS])
@pytest.mark.parametrize("shape", [plane_depth, cylinder_depth])
def test_points_lie_on_the_analytic_surface(
    lens: tuple[float, float, float, float, float], shape: Callable[[Floats], Floats]
) -> None:
    rig = small_rig(distortion=lens)
    rays = camera_rays(rig.camera)
    depth = shape(rays)
    uv = rig.correspond(rays * depth[..., None])
    points, _ = triangulate(exact(depth, uv), rig)
    found = np.isfinite(points[..., 2])
    assert (found == np.isfinite(depth)).all()
    # float32 columns carry about 1e-5 px, and a pixel is worth a few mm here
    np.testing.assert_allclose(points[found][:, 2], depth[found], atol=2e-4)
    np.testing.assert_allclose(epipolar_v(uv[..., 0], rig)[found], uv[..., 1][found], atol=1e-5)


def test_sigma_is_the_change_along_the_ray() -> None:
    rig = small_rig(distortion=LENS)
    rays = camera_rays(rig.camera)
    depth = plane_depth(rays)
    uv = rig.correspond(rays * depth[..., None])
    near, sigma = triangulate(exact(depth, uv), rig)
    far, _ = triangulate(exact(depth, uv + 0.05), rig)
    np.testing.assert_allclose(np.linalg.norm(far - near, axis=-1), sigma, rtol=2e-2)


def test_columns_that_meet_no_ray_give_no_point() -> None:
    rig = small_rig()
    u = np.full(rig.camera.shape, -1e5, np.float32)
    points, _ = triangulate(Correspondence(u, np.ones_like(u), np.ones(u.shape, bool)), rig)
    z = points[..., 2]
    assert not (np.isfinite(z) & (z <= 0.0)).any()
