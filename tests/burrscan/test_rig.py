"""The devices' model against OpenCV's, and its own inverse."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from burrscan.errors import InputError
from burrscan.rig import View
from scenes.rig import RigSpec

BENT = (-0.12, 0.08, 1e-3, -8e-4, 0.02)
VIEW = View(640, 512, 1370.0, 1372.0, 322.5, 250.25, BENT)


def test_projection_is_opencvs() -> None:
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(-120, 120, (200, 2)), rng.uniform(450, 750, 200)])
    expected, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), VIEW.matrix, np.array(BENT))
    assert VIEW.project(points) == pytest.approx(expected[:, 0], abs=1e-9)


@settings(max_examples=50, deadline=None)
@given(st.floats(0, 639), st.floats(0, 511))
def test_rays_go_through_their_pixels(column: float, row: float) -> None:
    ray = VIEW.rays(np.array([column, row]))
    assert VIEW.project(ray * 600.0) == pytest.approx([column, row], abs=1e-6)


@pytest.mark.parametrize(
    "bent", [(0.0, -99999.0, 0.0, 0.0, 0.0), (-6.0, 0.0, 0.0, 0.0, 0.0), (1e200, 0.0, 0.0, 0.0, 0.0)]
)
def test_coefficients_that_fold_the_picture_over_are_no_lens(
    bent: tuple[float, float, float, float, float],
) -> None:
    with pytest.raises(InputError, match="no lens of 640×512 px"):
        replace(VIEW, distortion=bent)


def test_points_behind_a_device_have_no_pixel() -> None:
    assert np.isnan(VIEW.project(np.array([0.0, 0.0, -5.0]))).all()


def test_how_far_a_point_is_within_the_projectors_light() -> None:
    rig = RigSpec(scale=0.5).rig()
    width, height = 512, 384
    pixels = np.array([[9.5, 100.0], [200.0, height - 4.0], [-3.5, 50.0], [width - 0.5, 50.0]])
    turn, centre = rig.T_projector_camera[:3, :3], rig.projector_centre_mm
    points = 600.0 * rig.projector.rays(pixels) @ turn + centre
    assert rig.within_light_px(points) == pytest.approx([10.0, 3.5, -3.0, 0.0], abs=1e-9)
    assert np.isnan(rig.within_light_px(2.0 * centre - points)).all()


@pytest.mark.parametrize("azimuth", [0.0, 90.0, 215.0])
def test_both_devices_look_at_the_target(azimuth: float) -> None:
    spec = RigSpec(baseline_azimuth_deg=azimuth, projector_roll_deg=7.0, scale=0.5)
    rig = spec.rig()
    assert rig.baseline_mm == pytest.approx(200.0)
    middle = rig.correspond(np.array([0.0, 0.0, 600.0]))
    assert middle == pytest.approx([(512 - 1) / 2, (384 - 1) / 2], abs=1e-9)
    rotation = rig.T_projector_camera[:3, :3]
    assert rotation @ rotation.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1.0)


def test_a_scaled_rig_sees_the_same_field() -> None:
    point = np.array([31.0, -22.0, 580.0])
    full, half = (RigSpec(scale=s).rig().correspond(point) for s in (1.0, 0.5))
    assert (half + 0.5) * 2.0 - 0.5 == pytest.approx(full, abs=1e-9)
