import numpy as np

from bench.synthetic.revolution import revolution_scan
from burrscan.axis import find_axis
from burrscan.axis.checks import axis_checks
from burrscan.inspection import Axis


def test_a_good_axis_passes_and_a_wrong_one_fails() -> None:
    scan = revolution_scan(sigma_mm=0.2, shape=(240, 90))
    good = find_axis(scan.vertices_mm, scan.faces)
    tilted = good.direction + 0.1 * np.cross(good.direction, [0.3, 0.5, 0.8])
    wrong = Axis(good.point_mm, tilted / np.linalg.norm(tilted), good.covariance, "wrong")
    assert all(check.passed for check in axis_checks(scan.vertices_mm, scan.faces, good))
    failed = {check.name for check in axis_checks(scan.vertices_mm, scan.faces, wrong) if not check.passed}
    assert {"centres_collinear", "landscape_margin"} <= failed


def test_a_sphere_is_not_determined() -> None:
    scan = revolution_scan("sphere", sigma_mm=0.1, shape=(160, 80))
    axis = find_axis(scan.vertices_mm, scan.faces)
    assert not {c.name: c.passed for c in axis_checks(scan.vertices_mm, scan.faces, axis)}["determined"]


def test_symmetry_of_the_residual() -> None:
    scan = revolution_scan(sigma_mm=0.1, shape=(160, 60))
    axis = find_axis(scan.vertices_mm, scan.faces)
    rng = np.random.default_rng(0)
    noise = 0.1 * rng.normal(size=len(scan.vertices_mm))
    around = np.repeat(np.linspace(-1.2, 1.2, 160), 60)
    for deviation, passed in ((noise, True), (noise + 0.5 * np.sin(around), False)):
        checks = axis_checks(scan.vertices_mm, scan.faces, axis, deviation_mm=deviation)
        assert {c.name: c.passed for c in checks}["residual_symmetry"] is passed
