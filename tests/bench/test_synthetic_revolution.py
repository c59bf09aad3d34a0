"""The generator of synthetic scans agrees with the bounds that METHODS states."""

import numpy as np
import pytest

from bench.synthetic.axis_bound import cramer_rao_deg
from bench.synthetic.revolution import axis_angle_deg, revolution_scan


@pytest.mark.parametrize(
    ("profile", "arc_deg", "sigma_mm", "bound_deg"),
    [
        ("stepped_wheel", 140.0, 0.05, 0.0014),
        ("stepped_wheel", 140.0, 0.2, 0.0056),
        ("stepped_wheel", 140.0, 1.0, 0.028),
        ("stepped_wheel", 60.0, 0.05, 0.0067),
        ("stepped_wheel", 60.0, 0.2, 0.027),
        ("stepped_wheel", 60.0, 1.0, 0.135),
        ("cylinder", 140.0, 0.05, 0.0035),
        ("cylinder", 140.0, 0.2, 0.0139),
        ("cylinder", 140.0, 1.0, 0.069),
    ],
)
def test_bounds_are_those_of_methods(profile: str, arc_deg: float, sigma_mm: float, bound_deg: float) -> None:
    assert cramer_rao_deg(profile, arc_deg=arc_deg, sigma_mm=sigma_mm) == pytest.approx(bound_deg, rel=0.015)


def test_a_scan_lies_on_its_surface() -> None:
    scan = revolution_scan("cone")
    assert len(scan.faces) == 122_682
    part = (scan.vertices_mm - scan.point_mm) @ scan.T_mesh_part[:3, :3]
    np.testing.assert_allclose(np.hypot(part[:, 0], part[:, 1]), 85.0 + part[:, 2] / 2.0, atol=1e-9)


def test_angle_between_lines() -> None:
    tilted = np.array([0.0, np.sin(1e-9), -np.cos(1e-9)])
    assert axis_angle_deg(np.array([0.0, 0.0, 1.0]), tilted) == pytest.approx(np.degrees(1e-9))
