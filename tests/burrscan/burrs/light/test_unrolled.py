"""Which cells of the fitted surface are seen and lit, against rays that are marched through the solid."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy import ndimage

from burrscan.arrays import Bools, Floats
from burrscan.axis.basis import T_part_mesh
from burrscan.burrs.light.unrolled import Unrolled, unrolled
from burrscan.inspection import Axis, Generatrix
from burrscan.rig import Rig
from tests.burrscan.instrument import cylinder_depth, small_rig
from tests.tiers import some_of

_CYLINDER = np.array([[-50.0, 90.0], [50.0, 90.0]])
_STEPPED = np.array([[-50.0, 60.0], [-10.0, 60.0], [-10.0, 90.0], [20.0, 90.0], [20.0, 45.0], [50.0, 45.0]])
_FLANGED = np.array([[-60.0, 40.0], [10.0, 40.0], [10.0, 110.0], [40.0, 110.0]])
"""A hub whose end face nothing was measured of, so that its curve is an open tube, on a flange."""
_STEPS = 250


def part(profile: Floats, direction: tuple[float, float, float]) -> tuple[Axis, Generatrix]:
    """An axis through (40, 0, 690) and the profile about it, z counted from there."""
    d = np.asarray(direction) / np.linalg.norm(direction)
    point = np.array([40.0, 0.0, 690.0])
    axis = Axis(point, d, np.zeros((4, 4)), "exact")
    nothing = np.zeros(len(profile))
    return axis, Generatrix(profile[:, 0] + point @ d, profile[:, 1], nothing, nothing)


def inside(points: Floats, axis: Axis, profile: Floats, slack: float) -> Bools:
    """Whether points (..., 3) lie within the solid wheel, deeper than ``slack``."""
    local = points - axis.point_mm
    z = local @ axis.direction
    square = np.einsum("...i,...i->...", local, local) - z * z
    within = np.zeros(z.shape, bool)
    for (z0, r0), (z1, _) in pairwise(profile):
        within |= (z > z0 + slack) & (z < z1 - slack) & (square < (r0 - slack) ** 2)
    return within


def reached(points: Floats, centre: Floats, axis: Axis, profile: Floats, slack: float) -> Bools:
    """Which points nothing hides from a device: the ray to it is marched through the solid."""
    towards = centre - points
    distance = np.linalg.norm(towards, axis=-1, keepdims=True)
    hidden = np.zeros(points.shape[:-1], bool)
    for way in np.linspace(0.3, 150.0, _STEPS):
        hidden |= inside(points + way * towards / distance, axis, profile, slack)
    return ~hidden


def points_of(surface: Unrolled, axis: Axis) -> Floats:
    """(rows, columns, 3) the cells' middles in the camera frame, by the inverse of the part frame."""
    x, y = (surface.r_mm[:, None] * f(surface.angle) for f in (np.cos, np.sin))
    z = np.broadcast_to(surface.z_mm[:, None], x.shape)
    T = np.linalg.inv(T_part_mesh(axis.point_mm, axis.direction))
    return np.asarray(np.stack([x, y, z], axis=-1) @ T[:3, :3].T + T[:3, 3])


def in_raster(points: Floats, rig: Rig, margin: float) -> Bools:
    """Which points both devices have in their pictures, a margin of pixels from the border."""
    found = np.ones(points.shape[:-1], bool)
    for view, local in ((rig.camera, points), (rig.projector, rig.to_projector(points))):
        uv = view.project(local)
        found &= ((uv > margin) & (uv < np.array(view.shape[::-1]) - 1.0 - margin)).all(axis=-1)
    return found


@some_of(
    ("profile", "direction", "within"),
    [
        (_CYLINDER, (0, 1, 0), 4),
        (_STEPPED, (0, 1, 0), 4),
        (_STEPPED, (0.1, 1.0, 0.3), 4),
        (_STEPPED, (-0.1, 1.0, -0.3), 4),
        (_FLANGED, (0.0, 0.6, 0.8), 5),  # what shades is 70 mm in front: a pixel of it is wider than a cell
    ],
    ids=["cylinder", "stepped", "towards", "away", "from its end"],
    first=2,
)
def test_open_is_what_rays_from_both_devices_reach(
    profile: Floats, direction: tuple[float, float, float], within: int
) -> None:
    rig = small_rig(width=280)
    axis, curve = part(profile, direction)
    surface = unrolled(axis, curve, rig)
    points = points_of(surface, axis)
    seen = [reached(points, at, axis, profile, 0.02) for at in (np.zeros(3), rig.projector_centre_mm)]
    normal = (points - axis.point_mm) - (
        ((points - axis.point_mm) @ axis.direction)[..., None] * axis.direction
    )
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    up = surface.normal[:, None, :1] * axis.direction + surface.normal[:, None, 1:] * normal
    facing = np.full(points.shape[:2], np.inf)
    for at in (np.zeros(3), rig.projector_centre_mm):
        facing = np.minimum(facing, (up * (at - points)).sum(axis=-1) / np.linalg.norm(at - points, axis=-1))
    truth = seen[0] & seen[1] & (facing > 0.25) & in_raster(points, rig, 0.0)
    assert not (surface.open & ~truth).any()
    # nor what is next to a shadow or to what is hidden: penumbras, footprints
    dark = ndimage.binary_opening(~truth, np.ones((3, 3), bool))
    assert not (surface.open & ndimage.binary_dilation(dark)).any()
    whole = truth & in_raster(points, rig, 2.0)
    for least, cells, share in ((0.65, 3000, 0.99), (0.3, 5000, 0.98)):  # of flat cells a pixel holds many
        sure = ndimage.binary_erosion(whole & (facing > least), iterations=within)
        assert sure.sum() > cells
        assert (surface.open & sure).sum() > share * sure.sum()
    np.testing.assert_allclose(surface.facing[truth], facing[truth], atol=1e-9)


def test_an_end_face_is_looked_at_all_round_and_a_bore_is_not() -> None:
    """From above a flange's face is seen on the far side of its hub, too; a bore's wall mirrors itself."""
    rig = small_rig(width=280)
    axis, curve = part(_FLANGED, (0.0, 0.2, 1.0))
    surface = unrolled(axis, curve, rig)
    face = np.abs(surface.normal[:, 0]) > 0.9
    away = np.degrees(np.abs(surface.angle - surface.angle.mean()))
    assert away.max() == pytest.approx(180.0, abs=0.5)
    for near, far in ((0.0, 60.0), (60.0, 120.0), (120.0, 180.0)):
        part_of = surface.open[face][:, (away >= near) & (away < far)]
        assert part_of.mean() > 0.2
    # the same curve run through backwards is the inside of a hollow
    axis, hollow = part(_FLANGED[::-1], (0.0, 0.2, -1.0))
    inner = unrolled(axis, hollow, rig)
    wall = inner.normal[:, 1] < -0.9
    assert wall.any()
    assert not inner.open[wall].any()
    assert (inner.facing[wall] > 0.3).any()  # which both devices face


def test_a_shoulder_hides_and_shades() -> None:
    """Not vacuous: of a stepped wheel that leans, much that faces both devices is hidden from one."""
    rig = small_rig(width=320)
    axis, curve = part(_STEPPED, (0.1, 1.0, 0.3))
    surface = unrolled(axis, curve, rig)
    points = points_of(surface, axis)
    low = (surface.r_mm < 89.0) & (np.abs(surface.normal[:, 1]) > 0.5)
    hidden = ~reached(points, np.zeros(3), axis, _STEPPED, 0.02)
    shaded = ~reached(points, rig.projector_centre_mm, axis, _STEPPED, 0.02)
    facing = np.abs(surface.angle - surface.angle.mean()) < np.radians(50.0)
    for lost in (hidden, shaded):
        assert (lost & low[:, None] & facing).sum() > 200


@pytest.mark.parametrize("distortion", [(0.0,) * 5, (-0.2, 0.1, 1e-3, -1e-3, 0.0)], ids=["pinhole", "lens"])
def test_pixels_look_at_their_cells(distortion: tuple[float, float, float, float, float]) -> None:
    rig = small_rig(width=320, distortion=distortion)
    axis, curve = part(_CYLINDER, (0, 1, 0))
    surface = unrolled(axis, curve, rig)
    rays = rig.camera.rays(np.moveaxis(surface.pixel[::-1], 0, -1))
    points = rays * cylinder_depth(rays)[..., None]
    T = T_part_mesh(axis.point_mm, axis.direction)
    local = (points @ T[:3, :3].T + T[:3, 3])[surface.open]
    row, column = np.nonzero(surface.open)
    assert len(row) > 5000
    np.testing.assert_allclose(local[:, 2], surface.z_mm[row], atol=1e-4)
    np.testing.assert_allclose(np.hypot(local[:, 0], local[:, 1]), 90.0, atol=1e-6)
    turn = np.angle(np.exp(1j * (np.arctan2(local[:, 1], local[:, 0]) - surface.angle[column])))
    assert np.abs(turn).max() < 1e-4


def test_cells_are_as_large_as_pixels() -> None:
    rig = small_rig(width=320)
    axis, curve = part(_CYLINDER, (0, 1, 0))
    surface = unrolled(axis, curve, rig)
    row, column = (len(surface.z_mm) // 2, len(surface.angle) // 2)
    for moved in (
        np.diff(surface.pixel[:, row : row + 2, column]),
        np.diff(surface.pixel[:, row, column : column + 2]),
    ):
        assert np.linalg.norm(moved) == pytest.approx(
            1.15, abs=0.02
        )  # the front is 15 % nearer than the axis


def test_an_image_is_sampled_at_the_cells() -> None:
    rig = small_rig(width=320)
    axis, curve = part(_CYLINDER, (0, 1, 0))
    surface = unrolled(axis, curve, rig)
    row, column = np.mgrid[: rig.camera.height, : rig.camera.width].astype(float)
    found = surface.sampled(3.0 * row - column, order=1)[surface.open]
    np.testing.assert_allclose(found, (3.0 * surface.pixel[0] - surface.pixel[1])[surface.open], atol=1e-8)


@pytest.mark.parametrize("direction", [(0.0, 1.0, 0.0), (0.0, 1.0, 0.6), (0.3, 0.5, 1.0)])
def test_a_cell_is_a_pixel_however_the_axis_leans(direction: tuple[float, float, float]) -> None:
    """The part frame begins where the axis is nearest to the camera, which may be far above the wheel."""
    axis, generatrix = part(_CYLINDER, direction)
    rig = small_rig()
    expected = np.linalg.norm(axis.point_mm) / rig.camera.fx  # the cylinder's middle is the axis's point
    assert unrolled(axis, generatrix, rig).step_mm == pytest.approx(expected, rel=1e-6)
