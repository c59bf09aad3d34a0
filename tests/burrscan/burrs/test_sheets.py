"""Thin walls: what a view shows of a wall's other side is no burr, and a burr on the wall is one."""

import numpy as np
import pytest

from bench.synthetic.depth_view import single_view
from bench.synthetic.ordinary_parts import closed, turned
from burrscan.api import inspect_mesh
from burrscan.arrays import Floats, Ints32
from burrscan.burrs.sheets import of_another_surface
from tests.tiers import some_of

HEIGHT_MM = 2.0


def cup(tilt_deg: float, *, wall_mm: float = 4.0, ridge: bool = False) -> tuple[Floats, Ints32]:
    """A view of a cup of 40 mm radius, from above and aside; with a ridge where it faces the camera."""
    outline = [
        (0.0, 0.0),
        (0.0, 40.0),
        (60.0, 44.0),
        (60.0, 44.0 - wall_mm),
        (25.0, 41.5 - wall_mm),
        (25.0, 0.0),
    ]

    def lift(z: Floats, r: Floats, angle: Floats) -> Floats:
        tent = np.clip(1.0 - np.abs(np.angle(np.exp(1j * angle))) / np.radians(2.0), 0.0, None)
        on = (r > 39.0) & (z > 5.0) & (z < 50.0) & ridge
        return np.asarray(1.0 + HEIGHT_MM / 40.0 * tent * on)

    tilt = np.radians(tilt_deg)
    view = -np.array([np.sin(tilt), 0.0, np.cos(tilt)])
    return single_view(*turned(closed(outline), around=1440, lift=lift), view, pixels=200, sigma=0.1, seed=4)


@some_of(("tilt_deg", "wall_mm"), [(60.0, 2.0), (70.0, 2.0), (80.0, 2.0), (70.0, 3.0)])
@pytest.mark.parametrize("inside_out", [False, True])
def test_the_far_side_of_a_wall_is_no_burr(*, tilt_deg: float, wall_mm: float, inside_out: bool) -> None:
    vertices, faces = cup(tilt_deg, wall_mm=wall_mm)
    assert not inspect_mesh(vertices, np.ascontiguousarray(faces[:, ::-1]) if inside_out else faces).burrs


@some_of("tilt_deg", [40.0, 55.0, 70.0])
def test_a_burr_on_a_thin_wall_is_found(tilt_deg: float) -> None:
    (burr,) = inspect_mesh(*cup(tilt_deg, ridge=True)).burrs
    assert burr.side == "protrusion"
    assert burr.height_mm.value == pytest.approx(HEIGHT_MM, abs=0.6)


def _slab() -> tuple[Floats, Ints32]:
    """Two square grids 3 mm apart at a radius of 50 mm: one looks out, the other in."""
    y, z = (each.ravel() for each in np.meshgrid(np.linspace(-9.0, 9.0, 19), np.linspace(-9.0, 9.0, 19)))
    index = np.arange(19 * 19, dtype=np.int32).reshape(19, 19)
    a, b, c, d = (each.ravel() for each in (index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]))
    out = np.concatenate([np.stack([a, b, c], axis=1), np.stack([b, d, c], axis=1)])
    points = np.concatenate(
        [np.stack([np.full(361, x), y, z], axis=1) for x in (50.0, 50.0, 50.0, 50.0, 47.0)]
    )
    faces = [out + 361 * k for k in range(4)] + [out[:, ::-1] + 361 * 4]
    return points, np.concatenate(faces).astype(np.int32)


def test_only_what_lies_within_and_looks_back_is_another_surface() -> None:
    points, faces = _slab()
    normal, distance = np.tile([0.0, 1.0], (len(points), 1)), points[:, 0] - 50.0
    distance += 0.01 * np.random.default_rng(1).normal(size=len(points))
    far = np.arange(len(points)) >= 4 * 361
    np.testing.assert_array_equal(of_another_surface(points, faces, normal, distance), far)
    assert not of_another_surface(points, faces[:0], normal, distance).any()
    outside = np.where(far, -distance, distance)
    assert not of_another_surface(points, faces, normal, outside).any()
    looking_out = faces.copy()
    looking_out[far[faces[:, 0]]] = looking_out[far[faces[:, 0]]][:, ::-1]
    assert not of_another_surface(points, looking_out, normal, distance).any()
