"""Imperfections of the instrument, each against what it should do to the light."""

from typing import Any

import numpy as np
import pytest

from burrscan import Patterns
from burrscan.arrays import Floats32
from burrscan.triangulation import camera_rays
from scenes.calibration import CalibrationSpec
from scenes.electronics.drift import falloff, per_picture, shifted
from scenes.rig import DeviceSpec, RigSpec
from scenes.scanner import SimulatedScanner
from scenes.scene import scene_from
from scenes.transport.matrix import LightTransport
from scenes.transport.rows import SparseRows, empty_rows


def identity_scanner(*, surround: float = 0.0, **tables: Any) -> SimulatedScanner:
    """A camera that sees the projector's raster pixel for pixel, and ``surround`` of a uniform surround."""
    rig = {
        "camera": {"width": 64, "height": 48, "focal_px": 100.0},
        "projector": {"width": 64, "height": 48, "focal_px": 100.0},
    }
    scene = scene_from({"wheel": "cylinder", "finish": "matte", "rig": rig, **tables}, source="test")
    count = 64 * 48
    rows = SparseRows(np.arange(count + 1), np.arange(count, dtype=np.int32), np.full(count, 0.5, np.float32))
    blank = np.zeros((48, 64), np.float32)
    ambient = np.full((48, 64), surround, np.float32)
    light = LightTransport((48, 64), (48, 64), rows, empty_rows(48 * 64), ambient, blank, blank, blank, blank)
    return SimulatedScanner(light, scene=scene, rig=scene.rig.rig(), identity=(7,))


def pictures(scanner: SimulatedScanner, frames: int = 40) -> Floats32:
    """Electrons under full white that fill half the well."""
    white = Patterns(np.full((frames, 48, 64), 255, np.uint8), tuple(str(i) for i in range(frames)))
    sheet = scanner.camera
    images = scanner.capture(white, 20.0)
    return ((images - sheet.black_level_dn) / sheet.gain_dn_per_e).astype(np.float32)


def test_a_perfect_instrument_fills_half_the_well() -> None:
    assert pictures(identity_scanner()).mean() == pytest.approx(5000.0, rel=1e-3)


def test_flicker_changes_whole_pictures() -> None:
    got = pictures(identity_scanner(projector={"flicker": 0.02}), frames=200)
    means = got.mean(axis=(1, 2)) / 5000.0
    assert means.std() == pytest.approx(0.02, rel=4.0 / np.sqrt(400.0))
    assert pictures(identity_scanner()).mean(axis=(1, 2)).std() < 5.0


def test_dark_current_adds_light_that_grows_with_time() -> None:
    scanner = identity_scanner(camera={"dark_current_e_per_s": 5000.0})
    assert pictures(scanner).mean() == pytest.approx(5000.0 + 100.0, rel=1e-3)


@pytest.mark.parametrize("device", ["camera", "projector"])
def test_vignetting_darkens_the_corners(device: str) -> None:
    tables: dict[str, Any] = {device: {"vignetting": 0.4}}
    got = pictures(identity_scanner(**tables)).mean(axis=0)
    assert got[0, 0] == pytest.approx(
        3000.0, rel=0.03
    )  # the corner pixel's middle is not quite in the corner
    assert got[24, 32] == pytest.approx(5000.0, rel=0.02)


def test_vignetting_is_the_fourth_power_of_the_cosine() -> None:
    """A lens that loses by its corner's angle loses everywhere by the pixel's: cos⁴ about the axis."""
    view = RigSpec(camera=DeviceSpec(width=640, height=512, focal_px=900.0, cx=300.0, cy=280.0)).rig().camera
    corner = np.arctan2(0.5 * np.hypot(640.0, 512.0), 900.0)
    rays = view.rays(view.pixel_grid())
    cosine = 1.0 / np.linalg.norm(rays, axis=-1)
    np.testing.assert_allclose(falloff(view, 1.0 - np.cos(corner) ** 4), cosine**4, rtol=1e-5)
    assert (falloff(view, 0.0) == 1.0).all()


def test_ambient_light_and_black_level_are_what_is_stated() -> None:
    """An unlit scene in a surround: ambient · share reflected · electrons of light 1, on the black level."""
    frames = 40
    dark = Patterns(np.zeros((frames, 48, 64), np.uint8), tuple(str(i) for i in range(frames)))
    tables: dict[str, Any] = {"projector": {"contrast": 1e9}, "camera": {"black_level_dn": 24.0}}
    for ambient in (0.0, 0.05):
        scanner = identity_scanner(surround=0.7, light={"ambient": ambient}, **tables)
        mean = scanner.capture(dark, 20.0).astype(float).mean()
        gain = (1023.0 - 24.0) / 10_000.0
        assert mean == pytest.approx(24.0 + gain * 10_000.0 * ambient * 0.7, abs=0.02)


def test_projected_light_follows_the_stated_curve_and_contrast() -> None:
    """Black 1 / contrast, then a power of the level: as the camera sees it, level by level."""
    levels = np.arange(0, 256, 17, dtype=np.uint8)
    shown = Patterns(
        np.broadcast_to(levels[:, None, None], (len(levels), 48, 64)), tuple(str(n) for n in levels)
    )
    scanner = identity_scanner(
        projector={"gamma": 1.7, "contrast": 50.0},
        camera={"full_well_e": 1e6, "read_noise_e": 1e3},  # noise that dithers the rounding
        light={"ambient": 0.0},
    )
    seen = scanner.capture(shown, 20.0).astype(float).mean(axis=(1, 2)) - 8.0
    light = 0.02 + 0.98 * (levels / 255.0) ** 1.7
    assert seen == pytest.approx(0.5 * 1015.0 * light, abs=0.05, rel=2e-4)


@pytest.mark.parametrize("bits", [8, 10, 12])
def test_values_are_quantised_to_the_stated_bits(bits: int) -> None:
    scanner = identity_scanner(camera={"bit_depth": bits, "read_noise_e": 0.0, "full_well_e": 1e7})
    frames = Patterns(np.full((4, 48, 64), 255, np.uint8), ("0", "1", "2", "3"))
    assert (scanner.capture(frames, 60.0) == 2**bits - 1).all()
    step_e = 1e7 / (2**bits - 1 - 8.0)
    dark = scanner.capture(frames, 10.0).astype(float)
    assert abs((dark.mean() - 8.0) * step_e - 2.5e6) < 0.5 * step_e
    assert dark.std() < 0.5 + 2.0 * np.sqrt(2.5e6) / step_e


@pytest.mark.parametrize("device", ["camera_px", "projector_px"])
def test_vibration_moves_pictures_by_what_is_stated(device: str) -> None:
    scanner = identity_scanner(vibration={device: 0.3}, camera={"full_well_e": 1e6})
    frames = 300
    ramp = np.broadcast_to(np.arange(64, dtype=np.uint8) * 3, (frames, 48, 64))
    images = scanner.capture(Patterns(ramp, tuple(str(i) for i in range(frames))), 20.0).astype(float)
    middle = images[:, 20:28, 28:36]
    slope = np.gradient(images.mean(axis=(0, 1)))[28:36].mean()
    moved = (middle.mean(axis=(1, 2)) - middle.mean()) / slope
    assert moved.std() == pytest.approx(0.3, rel=4.0 / np.sqrt(2 * frames))


def test_shifting_is_the_stated_motion() -> None:
    ramp = np.broadcast_to(np.arange(9.0, dtype=np.float32), (1, 5, 9))
    moved = shifted(ramp, np.array([[0.25, 0.0]]))
    assert moved[0, 2, 2:7] == pytest.approx(ramp[0, 2, 2:7] - 0.25)


def test_draws_belong_to_the_picture() -> None:
    whole = per_picture((1, 2), "x", 0, 5, 3)
    assert np.array_equal(whole[2:], per_picture((1, 2), "x", 2, 3, 3))
    assert not np.array_equal(whole, per_picture((1, 2), "y", 0, 5, 3))


def test_the_told_rig_is_off_by_what_is_stated() -> None:
    rig = RigSpec().rig()
    spec = CalibrationSpec(
        rotation_deg=(0.0, 0.1, 0.0), camera_focal_share=0.01, projector_principal_px=(1.0, 0.0)
    )
    told = spec.told(rig)
    point = np.array([0.0, 0.0, 600.0])
    moved = told.correspond(point) - rig.correspond(point)
    assert moved[0] == pytest.approx(1.0 + np.tan(np.radians(0.1)) * rig.projector.fx, abs=0.02)
    assert told.camera.fx == pytest.approx(1.01 * rig.camera.fx)
    assert CalibrationSpec().told(rig).T_projector_camera == pytest.approx(rig.T_projector_camera)


def test_a_wrong_baseline_scales_the_depth() -> None:
    """Told 1 % too long a baseline, what is triangulated from true correspondences is 1 % too far."""
    rig = RigSpec(projector_target_mm=(200.0, 0.0, 600.0)).rig()  # parallel axes
    told = CalibrationSpec(translation_mm=(-2.0, 0.0, 0.0)).told(rig)
    assert told.baseline_mm == pytest.approx(1.01 * rig.baseline_mm)
    rays = camera_rays(rig.camera)[::64, ::64]
    points = rays * 600.0
    u_px = rig.correspond(points)[..., 0]
    assert told.correspond(points * 1.01)[..., 0] == pytest.approx(u_px, abs=1e-9)


def test_a_scanner_with_everything_on_repeats_itself() -> None:
    tables: dict[str, Any] = {
        "vibration": {"camera_px": 0.1, "projector_px": 0.1},
        "projector": {"flicker": 0.01, "vignetting": 0.2},
        "camera": {"dark_current_e_per_s": 30.0, "vignetting": 0.1},
    }
    assert np.array_equal(pictures(identity_scanner(**tables), 6), pictures(identity_scanner(**tables), 6))
