"""Imperfections of the instrument, each against what it should do to the light."""

from typing import Any

import numpy as np
import pytest

from burrscan import Patterns
from burrscan.arrays import Floats32
from scenes.calibration import CalibrationSpec
from scenes.electronics.drift import falloff, per_picture, shifted
from scenes.rig import RigSpec
from scenes.scanner import SimulatedScanner
from scenes.scene import scene_from
from scenes.transport.matrix import LightTransport, SparseRows


def identity_scanner(**tables: Any) -> SimulatedScanner:
    """A camera that sees the projector's raster pixel for pixel."""
    rig = {
        "camera": {"width": 64, "height": 48, "focal_px": 100.0},
        "projector": {"width": 64, "height": 48, "focal_px": 100.0},
    }
    scene = scene_from({"wheel": "cylinder", "finish": "matte", "rig": rig, **tables}, source="test")
    count = 64 * 48
    rows = SparseRows(np.arange(count + 1), np.arange(count, dtype=np.int32), np.full(count, 0.5, np.float32))
    none = SparseRows(np.zeros(count + 1, np.int64), np.zeros(0, np.int32), np.zeros(0, np.float32))
    blank = np.zeros((48, 64), np.float32)
    light = LightTransport((48, 64), (48, 64), rows, none, blank, blank, blank, blank)
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
    got = pictures(identity_scanner(**{device: {"vignetting": 0.4}})).mean(axis=0)
    assert got[0, 0] == pytest.approx(3000.0, rel=0.02)
    assert got[24, 32] == pytest.approx(5000.0, rel=0.02)
    assert falloff((48, 64), 0.4).min() == pytest.approx(0.6)


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


def test_a_scanner_with_everything_on_repeats_itself() -> None:
    tables = {
        "vibration": {"camera_px": 0.1, "projector_px": 0.1},
        "projector": {"flicker": 0.01, "vignetting": 0.2},
        "camera": {"dark_current_e_per_s": 30.0, "vignetting": 0.1},
    }
    assert np.array_equal(pictures(identity_scanner(**tables), 6), pictures(identity_scanner(**tables), 6))
