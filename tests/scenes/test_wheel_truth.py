from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from burrscan.arrays import Floats
from burrscan.errors import InputError
from scenes.wheel import AxialRidge, RimBurr, build_wheel, deviation_mm, load_wheel, wheel_names
from tests.scenes.wheels import CYLINDER, STEPPED

BOX = np.array([[-30.0, 0.0], [-30.0, 100.0], [30.0, 100.0], [30.0, 0.0]])


def _box_distance(points: Floats) -> Floats:
    """Signed distance of a solid cylinder in closed form."""
    dz = np.abs(points[:, 2]) - 30.0
    dr = np.hypot(points[:, 0], points[:, 1]) - 100.0
    return np.asarray(
        np.minimum(np.maximum(dz, dr), 0.0) + np.hypot(np.maximum(dz, 0.0), np.maximum(dr, 0.0))
    )


@pytest.mark.parametrize("count", [300, 60_000])
def test_the_deviation_from_a_cylinder_is_its_signed_distance(count: int) -> None:
    points = np.random.default_rng(1).uniform([-130, -130, -45], [130, 130, 45], size=(count, 3))
    assert np.allclose(deviation_mm(points, BOX), _box_distance(points), atol=1e-9)


@settings(max_examples=20, deadline=None)
@given(angle=st.floats(0.0, 6.28), share=st.floats(0.0, 1.0), off=st.floats(-1.5, 1.5))
def test_a_point_off_a_fillet_along_its_normal_deviates_by_that_much(
    angle: float, share: float, off: float
) -> None:
    wheel = build_wheel(STEPPED, (), facet_error_mm=0.01)
    # the concave fillet of radius 2 about (z, r) = (-2, 82)
    direction = np.array([np.cos(-share * np.pi / 2), np.sin(-share * np.pi / 2)])
    z, r = np.array([-2.0, 82.0]) + direction * (2.0 - off)
    point = np.array([[r * np.cos(angle), r * np.sin(angle), z]])
    assert deviation_mm(point, wheel.generatrix_zr_mm)[0] == pytest.approx(off, abs=2e-5)


def test_300_000_points_take_less_than_a_second() -> None:
    wheel = build_wheel(load_wheel("paper"), ())
    rng = np.random.default_rng(0)
    points = wheel.vertices_mm[rng.integers(len(wheel.vertices_mm), size=300_000)]
    points = points + rng.normal(scale=0.1, size=points.shape)
    deviation_mm(points[:20_000], wheel.generatrix_zr_mm)
    start = time.process_time()
    deviation_mm(points, wheel.generatrix_zr_mm)
    assert time.process_time() - start < 2.0


def test_a_wheel_file_is_read_with_its_burrs(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(
        'name = "mine"\ngeneratrix = [[0, 0], [0, 50, 1], [20, 50], [20, 0]]\n'
        '[[burr]]\nkind = "rim"\nangle_deg = 3\narc_deg = 9\nheight_mm = 1\nwidth_mm = 1\nedge = 2\n'
    )
    spec = load_wheel(str(path))
    assert spec.generatrix[1] == (0.0, 50.0, 1.0)
    assert isinstance(spec.burr[0], RimBurr)
    assert build_wheel(spec).burrs[0].kind == "rim"


def test_every_error_of_a_wheel_file_is_listed(tmp_path: Path) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(
        'name = "bad"\ngeneratrix = [[0, 0], [0, 50], [20, 50], [20, 0]]\ndescripton = "x"\n'
        '[[burr]]\nkind = "axial_ridge"\nangle_deg = 3\nheight_mm = -1\nwidth_mm = 1\nz_start_mm = 0\n'
    )
    with pytest.raises(InputError) as caught:
        load_wheel(str(path))
    message = str(caught.value)
    assert "did you mean 'description'" in message
    assert "height_mm" in message
    assert "z_end_mm" in message


def test_an_unknown_wheel_suggests_the_nearest() -> None:
    with pytest.raises(InputError, match="did you mean 'paper'"):
        load_wheel("papper")
    assert len(wheel_names()) >= 5


def test_the_paper_wheel_has_its_size_and_burrs_on_both_sides() -> None:
    wheel = build_wheel(load_wheel("paper"), facet_error_mm=0.005)
    assert wheel.generatrix_zr_mm[:, 1].max() == pytest.approx(100.0)
    assert np.ptp(wheel.generatrix_zr_mm[:, 0]) == pytest.approx(60.0)
    middles = [(burr.z_start_mm + burr.z_end_mm) / 2.0 for burr in wheel.burrs]
    assert min(middles) < -10.0
    assert max(middles) > 10.0


def test_arrays_are_read_only() -> None:
    wheel = build_wheel(CYLINDER, [AxialRidge(0.0, 1.0, 2.0, 0.0, 9.0)], facet_error_mm=0.01)
    with pytest.raises(ValueError, match="read-only"):
        wheel.vertices_mm[0] = 0.0
    with pytest.raises(ValueError, match="read-only"):
        wheel.burrs[0].ridge_mm[0] = 0.0
