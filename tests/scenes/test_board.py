"""Rendered boards: true to geometry, and a calibration from them finds the true rig."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from bench.cli import main
from burrscan.arrays import Floats, Image
from burrscan.calibration.board import Board
from burrscan.calibration.photometric import calibrate_photometry
from burrscan.calibration.ramps import ExposureRamp, LevelRamp, ramp_exposures_ms
from burrscan.captures.folder import read_rig
from burrscan.captures.gray_folder import plain_gray_patterns
from burrscan.captures.png import write_grey
from burrscan.rig import Rig
from scenes.board import BoardSpec, board_images, board_light, board_poses
from scenes.electronics.spec import CameraSpec, ProjectorSpec
from scenes.renderer import activate
from scenes.rig import DeviceSpec, RigSpec
from scenes.transport.matrix import LightTransport
from scenes.transport.optics import Optics

BOARD = Board(9, 6, 20.0)
LENS = (-0.15, 0.1, 0.001, -0.001, 0.0)


@pytest.fixture(scope="module", autouse=True)
def _vectorised() -> None:
    if activate().variant().startswith("scalar"):
        pytest.skip("no vectorised Mitsuba variant on this machine; see 'burrscan doctor'")


def optics() -> Optics:
    camera = DeviceSpec(width=1280, height=1024, focal_px=2743.0, distortion=LENS)
    projector = DeviceSpec(width=1024, height=768, focal_px=2048.0, cy=440.0)
    return Optics(rig=RigSpec(camera=camera, projector=projector, scale=0.25).rig(), standoff_mm=600.0)


def values(rig: Rig) -> Floats:
    devices = [[v.fx, v.fy, v.cx, v.cy, *v.distortion[:4]] for v in (rig.camera, rig.projector)]
    turn = cv2.Rodrigues(rig.T_projector_camera[:3, :3])[0].ravel()
    return np.concatenate([*devices, turn, rig.T_projector_camera[:3, 3]])


def written(folder: Path, light: LightTransport, identity: tuple[int, ...] = (0,)) -> Path:
    """A board recorded as a plain Gray-code folder (:mod:`burrscan.captures.gray_folder`)."""
    folder.mkdir()
    height, width = light.projector_shape
    images = board_images(
        light,
        plain_gray_patterns(width=width, height=height).frames,
        camera=CameraSpec(),
        projector=ProjectorSpec(),
        exposure_ms=20.0,
        identity=identity,
    )
    for i, image in enumerate(images):
        write_grey(folder / f"graycode_{i:02d}.png", image)
    return folder


@pytest.mark.study
def test_calibrate_recovers_the_true_rig(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The whole command on rendered captures: 22 parameters within their joint uncertainty (chi², z < 4)."""
    poses = board_poses(BOARD, count=6, seed=1, standoff_mm=600.0, reach_mm=20.0)
    folders = [
        written(tmp_path / str(i), board_light(BoardSpec(BOARD), pose, optics(), seed=i), identity=(i,))
        for i, pose in enumerate(poses)
    ]
    out, report = tmp_path / "rig.json", tmp_path / "report.json"
    asked = ["calibrate", *map(str, folders), "--board", "9x6", "--square", "20", "--gray", "256x192"]
    assert main([*asked, "--out", str(out), "--json", str(report)]) == 0
    found = json.loads(report.read_text())
    assert np.max(found["rms_px"]) < 0.1
    off = np.array(list(found["values"].values())) - values(optics().rig)
    distance = off @ np.linalg.solve(np.array(found["covariance"]), off)
    assert distance < len(off) + 4.0 * np.sqrt(2.0 * len(off))
    assert abs(read_rig(out).baseline_mm - optics().rig.baseline_mm) < 0.5
    assert "camera.fx" in capsys.readouterr().out


def test_a_view_without_the_board_is_left_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pose = board_poses(BOARD, count=1, seed=0, standoff_mm=600.0, reach_mm=0.0)[0]
    even = board_light(BoardSpec(BOARD, black=0.8), pose, optics())
    folder = written(tmp_path / "even", even)
    asked = ["calibrate", str(folder), "--board", "9x6", "--square", "20", "--gray", "256x192"]
    assert main([*asked, "--out", str(tmp_path / "rig.json")]) == 2
    told = capsys.readouterr().err
    assert "left out" in told
    assert "no board of 9×6 inner corners" in told
    assert "0 view(s) of the board: at least 3" in told
    assert not (tmp_path / "rig.json").exists()


@pytest.mark.study
def test_rendered_ramps_give_the_curves_back() -> None:
    """A white board, traced; exposure ramp under the white projector, level ramp: curves within 1 %."""
    pose = np.eye(4)
    pose[:3, 3] = (-80.0, -50.0, 600.0)
    light = board_light(BoardSpec(BOARD, black=0.8), pose, optics())
    middle = slice(96, 160), slice(120, 200)
    camera, projector = CameraSpec(black_level_dn=12.0), ProjectorSpec(gamma=2.0, contrast=500.0)

    def picture(level: int, exposure_ms: float, identity: int, ambient: float) -> Image:
        frame = np.full((1, *light.projector_shape), level, np.uint8)
        image: Image = board_images(
            light,
            frame,
            camera=camera,
            projector=projector,
            exposure_ms=exposure_ms,
            identity=(identity,),
            ambient=ambient,
        )[0]
        return image[middle]

    times = ramp_exposures_ms(28.0)
    lamp = ExposureRamp(
        np.stack([picture(255, t, i, 0.002) for i, t in enumerate(times)]), times, np.ones(len(times), bool)
    )
    levels = np.tile(np.arange(0, 256, 15), 2)
    exposures = np.repeat([20.0, 200.0], len(levels) // 2)
    images = [
        picture(int(n), t, 100 + i, 0.0) for i, (n, t) in enumerate(zip(levels, exposures, strict=True))
    ]
    ramp = LevelRamp(np.stack(images), exposures, levels[:, None])
    found = calibrate_photometry([lamp], ramp, bit_depth=camera.bit_depth)
    truth = np.maximum(np.arange(1024) - 12.0, 0.0) / (1023.0 - 12.0)
    assert np.abs(found.camera[0].light - truth)[12:].max() < 0.01
    assert np.abs(found.projector.sheets[0].light - projector.sheet.light).max() < 0.01
