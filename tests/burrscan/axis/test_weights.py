"""Stated noise of the vertices: used where errors are those of pixels, not where neighbours share more."""

import numpy as np
import pytest

from bench.synthetic.revolution import RevolutionScan, axis_angle_deg, revolution_scan
from burrscan.arrays import Floats
from burrscan.axis import find_axis
from burrscan.axis.fitting.covariance import AxisCovariance
from burrscan.axis.fitting.fit import frame_of, refine, rotation_by
from burrscan.axis.profile import axis_between, chosen_fit

SHAPE = (242, 80)


def clean(seed: int) -> tuple[RevolutionScan, Floats, Floats]:
    """A scan without noise, its vertices in the part's frame, and their angles from the middle of the arc."""
    scan = revolution_scan(shape=SHAPE, sigma_mm=0.0, seed=seed)
    pose = np.linalg.inv(scan.T_mesh_part)
    part = scan.vertices_mm @ pose[:3, :3].T + pose[:3, 3]
    angle = np.arctan2(part[:, 1], part[:, 0])
    middle = np.angle(np.exp(1j * angle).sum())
    return scan, part, np.angle(np.exp(1j * (angle - middle)))


def error_deg(scan: RevolutionScan, part: Floats, lift: Floats, sigma: Floats | None) -> float:
    """Of the axis when every vertex is lifted off the axis by ``lift``."""
    outward = part * [1.0, 1.0, 0.0]
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    moved = (part + lift[:, None] * outward) @ scan.T_mesh_part[:3, :3].T + scan.T_mesh_part[:3, 3]
    return axis_angle_deg(find_axis(moved, scan.faces, sigma_mm=sigma).direction, scan.T_mesh_part[:3, 2])


def test_quiet_vertices_count_for_more() -> None:
    """Noise of 0.05 mm in every other stretch of 10 degrees, 1 mm between: eight scans together."""
    squares = np.zeros(2)
    for seed in range(8):
        scan, part, angle = clean(seed)
        sigma = np.where(np.floor(np.degrees(angle) / 10.0) % 2 == 0, 0.05, 1.0)
        lift = sigma * np.random.default_rng(seed).normal(size=len(sigma))
        squares += [error_deg(scan, part, lift, said) ** 2 for said in (sigma, None)]
    assert squares[0] < 0.2 * squares[1]


@pytest.mark.parametrize("seed", range(4))
def test_errors_that_quiet_neighbours_share_do_not_decide(seed: int) -> None:
    """Two quiet patches, one leaning by 0.1 mm along the axis: they alone would tilt it by 0.2 degrees."""
    scan, part, angle = clean(seed)
    quiet = np.abs(np.abs(np.degrees(angle)) - 30.0) < 6.0
    sigma = np.where(quiet, 0.01, 0.1)
    lift = sigma * np.random.default_rng(seed).normal(size=len(sigma))
    z = part[:, 2] - part[:, 2].mean()
    lift += np.where(quiet & (angle > 0.0), 0.1 * z / np.abs(z).max(), 0.0)
    assert error_deg(scan, part, lift, sigma) < 0.05


def test_the_motion_between_two_axes_brings_one_onto_the_other() -> None:
    scan = clean(0)[0]
    points = (scan.vertices_mm - scan.point_mm) / 90.0
    one = refine(points, np.empty(0), scan.direction, np.zeros(3), blur=0.05, steps=0)
    tilted = frame_of(scan.direction + np.array([0.05, -0.02, 0.03]))[:, 2]
    other = refine(points, np.empty(0), tilted / np.linalg.norm(tilted), np.full(3, 0.2), blur=0.05, steps=0)
    motion = axis_between(one, other)
    turn = rotation_by(motion[:2] * np.arctan(np.hypot(*motion[:2])) / np.hypot(*motion[:2]))
    moved = one.frame @ turn[:, 2]
    np.testing.assert_allclose(moved, other.frame[:, 2], atol=1e-12)
    on_it = one.place + one.frame[:, :2] @ motion[2:]
    np.testing.assert_allclose(np.cross(on_it - other.place, other.frame[:, 2]), 0.0, atol=1e-12)


@pytest.mark.parametrize(("sigmas", "first"), [(2.0, True), (4.0, False)])
def test_the_stated_weights_go_where_equal_ones_exclude_their_axis(sigmas: float, *, first: bool) -> None:
    """However sure the weighted fit says it is; 3.1 sigma of four unknowns are 5 %."""
    scan = clean(0)[0]
    points = (scan.vertices_mm - scan.point_mm) / 90.0
    equal = refine(points, np.empty(0), scan.direction, np.zeros(3), blur=0.05, steps=0)
    covariance = np.diag([1e-4, 4e-4, 1e-6, 1e-6])
    moved = equal.place + sigmas * 1e-3 * equal.frame[:, 0]
    weighted = refine(points, np.empty(0), scan.direction, moved, blur=0.05, steps=0)
    for surety in (1e-6, 1e6):
        stated = [AxisCovariance(surety * covariance, 0.01), AxisCovariance(covariance, 0.01)]
        assert chosen_fit([weighted, equal], stated)[0] is (weighted if first else equal)
