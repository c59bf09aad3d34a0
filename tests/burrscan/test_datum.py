"""A datum goes with the part: however it is laid down, its burrs keep their angle and their z."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import burrscan
from bench.synthetic.revolution import RidgeBurr, random_pose, revolution_scan
from burrscan import Datum
from burrscan.errors import InputError
from burrscan.generatrix import deviation_mm
from tests.tiers import some_of

SCAN = revolution_scan(sigma_mm=0.01, shape=(300, 80), burrs=(RidgeBurr(angle_deg=25.0, z_end_mm=0.0),))
BACK = np.linalg.inv(SCAN.T_mesh_part)


def datum_of(pose: Any) -> Datum:
    """Of the part: a mark at 40 degrees, up along its z, its origin off the axis at z = -20 mm."""
    mark = [90.0 * np.cos(np.radians(40.0)), 90.0 * np.sin(np.radians(40.0)), 3.0]
    zero, origin = (tuple(pose[:3, :3] @ point + pose[:3, 3]) for point in (mark, [70.0, 10.0, -20.0]))
    return Datum(zero_mm=zero, up=tuple(pose[:3, 2] + 0.3 * pose[:3, 0]), origin_mm=origin)


@some_of("seed", range(6))
def test_a_part_laid_down_anew_keeps_its_angles_and_its_z(seed: int) -> None:
    pose = random_pose(np.random.default_rng(seed))
    local = (SCAN.vertices_mm - SCAN.T_mesh_part[:3, 3]) @ SCAN.T_mesh_part[:3, :3]
    vertices = local @ pose[:3, :3].T + pose[:3, 3]
    found = burrscan.inspect_mesh(vertices, SCAN.faces, sigma_mm=0.01, datum=datum_of(pose))
    (burr,) = found.burrs
    assert burr.angle_deg.value == pytest.approx(25.0 - 40.0, abs=0.1)
    assert burr.z_start_mm.value == pytest.approx(-10.0, abs=1.0)
    assert burr.z_end_mm.value == pytest.approx(20.0, abs=1.0)
    x, y, z = (found.T_part_mesh @ burr.T_mesh_burr)[:3, 3]
    assert np.degrees(np.arctan2(y, x)) == pytest.approx(burr.angle_deg.value, abs=1e-6)
    assert burr.z_start_mm.value < z < burr.z_end_mm.value
    np.testing.assert_allclose(found.T_part_mesh[2, :3], found.axis.direction)
    assert np.linalg.det(found.T_part_mesh[:3, :3]) == pytest.approx(1.0)


def test_a_turned_axis_keeps_its_surface_and_its_uncertainty() -> None:
    plain = burrscan.inspect_mesh(SCAN.vertices_mm, SCAN.faces, sigma_mm=0.01)
    turned = burrscan.referred_to(plain, Datum(up=tuple(-plain.axis.direction)))
    np.testing.assert_allclose(turned.axis.direction, -plain.axis.direction)
    assert turned.axis.sigma_deg == pytest.approx(plain.axis.sigma_deg)
    assert turned.burrs[0].z_start_mm.value == pytest.approx(-plain.burrs[0].z_end_mm.value)
    part = turned.T_part_mesh
    z = SCAN.vertices_mm @ part[2, :3] + part[2, 3]
    assert np.nanmin(turned.generatrix.z_mm) == pytest.approx(z.min(), abs=1.0)
    # the same material: the curve, read in the frame of its own axis, gives the same deviations
    mirrored = replace(turned.axis, direction=turned.axis.direction)
    again = deviation_mm(SCAN.vertices_mm, mirrored, turned.generatrix)
    np.testing.assert_allclose(again, plain.deviation_mm, atol=1e-6)


@some_of(
    ("datum", "message"),
    [
        (lambda axis: Datum(zero_mm=tuple(axis.point_mm)), "lies on the axis found"),
        (
            lambda axis: Datum(up=tuple(np.cross(axis.direction, [0.3, 0.4, 0.1]))),
            "perpendicular to the axis",
        ),
        (lambda _axis: Datum(origin_mm=(0.0, float("nan"), 0.0)), "three finite numbers"),
    ],
)
def test_a_datum_that_says_nothing_is_refused(datum: Any, message: str) -> None:
    plain = burrscan.inspect_mesh(SCAN.vertices_mm, SCAN.faces, sigma_mm=0.01)
    with pytest.raises(InputError, match=message):
        burrscan.referred_to(plain, datum(plain.axis))
