from __future__ import annotations

import numpy as np
import pytest

import burrscan
from bench.synthetic.revolution import RidgeBurr, revolution_scan
from burrscan.errors import InputError
from burrscan.pipeline import Stage
from tests.burrscan.parts import angle_in_frame_deg, turned


def test_one_call_on_a_mesh() -> None:
    scan = revolution_scan(sigma_mm=0.05, seed=1, burrs=(RidgeBurr(angle_deg=10.0),))
    inspection = burrscan.inspect_mesh(scan.vertices_mm, scan.faces, sigma_mm=0.05, limit_mm=1.0)
    assert scan.angle_error_deg(inspection.axis.direction) < 0.01
    (burr,) = inspection.burrs
    assert abs(turned(burr.angle_deg.value - angle_in_frame_deg(scan, inspection.axis, 10.0))) < 0.05
    assert burr.within_limit is False
    assert len(inspection.deviation_mm) == len(scan.vertices_mm)
    assert {"axis", "generatrix", "burrs"} <= set(inspection.timings_s)


def test_nan_vertices_keep_their_places() -> None:
    scan = revolution_scan(sigma_mm=0.05, seed=2)
    vertices = scan.vertices_mm.copy()
    vertices[7::31] = np.nan
    inspection = burrscan.inspect_mesh(vertices, scan.faces)
    assert np.isnan(inspection.deviation_mm[7::31]).all()
    assert np.isfinite(inspection.deviation_mm).mean() > 0.95
    assert inspection.burrs == ()


def test_repeated_vertices_keep_their_places() -> None:
    scan = revolution_scan(sigma_mm=0.05, shape=(120, 40))
    once = burrscan.inspect_mesh(scan.vertices_mm, scan.faces)
    soup = burrscan.inspect_mesh(
        scan.vertices_mm[scan.faces].reshape(-1, 3), np.arange(scan.faces.size).reshape(-1, 3)
    )
    np.testing.assert_allclose(soup.deviation_mm, once.deviation_mm[scan.faces].ravel(), atol=1e-6)


def test_clouds_and_lists_are_welcome() -> None:
    scan = revolution_scan(sigma_mm=0.05, seed=3, shape=(200, 100))
    inspection = burrscan.inspect_mesh(scan.vertices_mm.tolist())
    assert scan.angle_error_deg(inspection.axis.direction) < 0.1


def test_methods_by_name_stage_and_dotted_path() -> None:
    scan = revolution_scan("cone", sigma_mm=0.05, seed=4, shape=(240, 80))
    inspection = burrscan.inspect_mesh(
        scan.vertices_mm,
        scan.faces,
        generatrix=Stage("radius", {"bins": 40}),
        burrs="burrscan.burrs.rivals.seed:burrs_seed",
    )
    assert len(inspection.generatrix.z_mm) == 40
    assert len(inspection.burrs) == 1


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"axis": "profil"}, "did you mean 'profile'"),
        ({"burrs": Stage("residual", {"limit": 1.0})}, "did you mean 'limit_mm'"),
        ({"generatrix": "nowhere.at_all:fit"}, "is the package installed"),
        ({"sigma_mm": np.ones(3)}, "one number or one per vertex"),
    ],
)
def test_bad_requests_are_explained(options: dict[str, object], message: str) -> None:
    scan = revolution_scan("cone", shape=(40, 20))
    with pytest.raises(InputError, match=message):
        burrscan.inspect_mesh(scan.vertices_mm, scan.faces, **options)  # type: ignore[arg-type]


def test_too_little_is_said() -> None:
    with pytest.raises(InputError, match="usable vertices"):
        burrscan.inspect_mesh(np.full((100, 3), np.nan))
    with pytest.raises(InputError, match="shape"):
        burrscan.inspect_mesh(np.zeros((10, 2)))
