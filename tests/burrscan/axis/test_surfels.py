"""Planes through the points of a voxel, degenerate ones first."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats
from burrscan.axis.points.surfels import planes_of


def moments(points: Floats) -> Floats:
    """Number, sums and sums of products (xx, xy, xz, yy, yz, zz)."""
    products = points[:, [0, 0, 0, 1, 1, 2]] * points[:, [0, 1, 2, 1, 2, 2]]
    return np.array([len(points), *points.sum(axis=0), *products.sum(axis=0)])


def test_points_that_are_one_or_in_line_have_a_normal_and_are_not_flat() -> None:
    """Rounding left a middle eigenvalue of zero: the flatness was NaN, and with it every axis of the part."""
    rng = np.random.default_rng(0)
    for k in range(5000):
        place, count = rng.normal(size=3) * 10.0 ** rng.uniform(-3.0, 3.0), int(rng.integers(1, 9))
        along = np.outer(rng.normal(size=count), rng.normal(size=3)) * 10.0 ** rng.uniform(-12.0, 0.0)
        (normal,), (flatness,) = planes_of(moments(place + along * (k % 2))[None])
        assert abs(np.linalg.norm(normal) - 1.0) < 1e-9
        assert 0.0 <= flatness <= 1.0 + 1e-9


def test_a_plane_is_its_own_normal() -> None:
    rng = np.random.default_rng(1)
    normal = np.array([2.0, -1.0, 2.0]) / 3.0
    points = rng.normal(size=(30, 3))
    points = points - np.outer(points @ normal, normal) + [1.0, 2.0, 3.0]
    (found,), (flatness,) = planes_of(moments(points)[None])
    assert abs(found @ normal) > 1.0 - 1e-9
    assert flatness < 1e-9
