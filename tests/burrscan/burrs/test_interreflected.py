"""A corner that mirrors itself is no burr: places and columns by formulas of a cylinder on a flange."""

from __future__ import annotations

import numpy as np
import pytest

from burrscan.arrays import Bools, Floats
from burrscan.burrs import residual
from burrscan.burrs.interreflected import is_interreflected, share_mirrored
from burrscan.generatrix.polyline import polyline_of
from burrscan.inspection import Generatrix
from burrscan.triangulation import camera_rays
from tests.burrscan.burrs.light.scene import HALF_LENGTH_MM, Scene, burrs_of
from tests.tiers import some_of

FROM_ABOVE = (0.0, 0.87, 0.5)
"""The axis points down and away from the camera, which looks on the flange at its lower end."""
FLANGE_MM = 40.0
"""By how much the flange is wider than the cylinder."""


def corner() -> Scene:
    """The cylinder with a flange, of which the mesh shows nothing."""
    scene = Scene(FROM_ABOVE)
    start, end = scene.generatrix.z_mm
    z, r = np.array([start, end, end]), scene.radius_mm + np.array([0.0, 0.0, FLANGE_MM])
    scene.generatrix = Generatrix(z, r, np.zeros(3), np.zeros(3))
    return scene


def columns(scene: Scene) -> tuple[Floats, Floats]:
    """Per pixel the projector's column of the cylinder, and of the flange that is seen mirrored in it."""
    d = np.asarray(scene.direction) / np.linalg.norm(scene.direction)
    ray = camera_rays(scene.rig.camera)
    mirrored = ray - 2.0 * (ray * scene.normal).sum(axis=-1, keepdims=True) * scene.normal
    with np.errstate(divide="ignore", invalid="ignore"):
        far = (HALF_LENGTH_MM - scene.along) / (mirrored @ d)
        far = np.where(far > 0.0, far, np.nan)
    there = scene.points + far[..., None] * mirrored
    out = there - np.asarray(scene.middle_mm)
    radius = np.linalg.norm(out - (out @ d)[..., None] * d, axis=-1)
    on = (radius > scene.radius_mm) & (radius < scene.radius_mm + FLANGE_MM)
    column = np.where(on, scene.rig.correspond(there)[..., 0], np.nan)
    return scene.rig.correspond(scene.points)[..., 0], column


def seen_at(scene: Scene, column: Floats) -> Floats:
    """Where the camera's rays meet planes of light: the depth at which a point is in a column."""
    pose, view = scene.rig.T_projector_camera, scene.rig.projector
    ray = camera_rays(scene.rig.camera)
    tangent = (column - view.cx) / view.fx
    x, z = ray @ pose[0, :3], ray @ pose[2, :3]
    depth = (tangent * pose[2, 3] - pose[0, 3]) / (x - tangent * z)
    return np.asarray(depth[..., None] * ray)


def near_corner(scene: Scene) -> Bools:
    return scene.band(-10.0, 16.0, 39.0, 46.0)


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0, 1.7, -0.3])
def test_the_share_is_that_of_the_way_to_the_mirrored_column(share: float) -> None:
    scene = corner()
    own, mirrored = columns(scene)
    cells = scene.on & np.isfinite(mirrored)
    assert np.count_nonzero(cells) > 1000
    points = seen_at(scene, own + share * (mirrored - own))[cells]
    found = share_mirrored(points, scene.axis, polyline_of(scene.generatrix), scene.rig)
    np.testing.assert_allclose(found, share, atol=1e-6)
    wanted = 0.25 < share < 1.5
    assert is_interreflected(points, scene.axis, polyline_of(scene.generatrix), scene.rig) == wanted


def test_where_nothing_is_mirrored_there_is_no_share() -> None:
    scene = corner()
    _, mirrored = columns(scene)
    cells = scene.on & ~np.isfinite(mirrored)
    line = polyline_of(scene.generatrix)
    assert np.isnan(share_mirrored(scene.points[cells], scene.axis, line, scene.rig)).all()
    assert not is_interreflected(scene.points[cells], scene.axis, line, scene.rig)
    assert not is_interreflected(scene.points[:0, 0], scene.axis, line, scene.rig)


def test_what_the_projector_does_not_reach_is_not_mirrored() -> None:
    """From behind its end face a flange is dark; the same ray would meet it."""
    scene = corner()
    own, mirrored = columns(scene)
    cells = scene.on & np.isfinite(mirrored)
    points = seen_at(scene, own + 0.6 * (mirrored - own))[cells]
    start, end = scene.generatrix.z_mm[:2]
    backwards = Generatrix(
        np.array([end, end, np.nan, start, end]),
        scene.radius_mm + np.array([FLANGE_MM, 0.0, np.nan, 0.0, 0.0]),
        np.zeros(5),
        np.zeros(5),
    )
    assert np.isnan(share_mirrored(points, scene.axis, polyline_of(backwards), scene.rig)).all()


@pytest.mark.parametrize("in_the_corner", [True, False])
def test_half_of_the_points_are_not_most_of_them(*, in_the_corner: bool) -> None:
    """Whether the others are points of the surface, or where nothing is mirrored."""
    scene = corner()
    own, mirrored = columns(scene)
    cells = scene.on & np.isfinite(mirrored)
    others = scene.points[cells if in_the_corner else scene.on & ~np.isfinite(mirrored)]
    image = seen_at(scene, own + 0.6 * (mirrored - own))[cells]
    points = np.concatenate([image, others[: len(image)]])
    line = polyline_of(scene.generatrix)
    assert not is_interreflected(points, scene.axis, line, scene.rig)
    assert is_interreflected(points[:-20], scene.axis, line, scene.rig)


@some_of("several", [False, True])
def test_an_image_of_the_flange_is_not_called(monkeypatch: pytest.MonkeyPatch, *, several: bool) -> None:
    scene = corner()
    own, mirrored = columns(scene)
    cells = near_corner(scene) & np.isfinite(mirrored)
    scene.points[cells] = seen_at(scene, own + 0.5 * (mirrored - own))[cells]
    scene.log_light[cells] += 1.0
    scene.lift_mm[scene.band(40.0, 20.0, -45.0, -30.0)] += 60.0  # a fixture: vertices that are on no curve
    assert burrs_of(scene, seen=True, several_views=several) == ()
    monkeypatch.setattr(residual, "is_interreflected", lambda *_, **__: False)
    assert len(burrs_of(scene, seen=True, several_views=several)) >= 1


def test_a_ridge_beside_the_flange_is() -> None:
    scene = corner()
    cells = scene.band(-10.0, 4.0, 25.0, 46.0)
    scene.lift_mm[cells] += 1.0
    scene.log_light[cells] -= 1.0
    (burr,) = burrs_of(scene, seen=True)
    assert burr.side == "protrusion"
