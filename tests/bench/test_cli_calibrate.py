"""``burrscan render`` and ``burrscan calibrate``: ramps give the true curves, coded boards the true rig."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest

from bench.cli import main
from burrscan.arrays import Floats
from burrscan.captures.folder import read_rig
from burrscan.captures.sheets import read_sheets
from burrscan.rig import Rig
from scenes.renderer import activate
from scenes.scene import SceneSpec, load_scene
from tests.tiers import some_of

CAMERA_MIX = ((1.0, 0.12, 0.03), (0.08, 1.0, 0.10), (0.02, 0.15, 1.0))
PROJECTOR_MIX = ((1.0, 0.06, 0.01), (0.10, 1.0, 0.07), (0.02, 0.09, 1.0))
SCENE = """\
wheel = "paper"
finish = "matte"
rig = {{scale = 0.2}}
camera = {{black_level_dn = 20.0, vignetting = 0.2, response = {{gamma = 0.6}}, crosstalk = {camera}}}
projector = {{gamma = 1.9, contrast = 600.0, crosstalk = {projector}}}
"""


@pytest.fixture(scope="module", autouse=True)
def _vectorised() -> None:
    if activate().variant().startswith("scalar"):
        pytest.skip("no vectorised Mitsuba variant on this machine; see 'burrscan doctor'")


def written(folder: Path, *, colour: bool) -> tuple[str, SceneSpec]:
    mixes = [[list(row) for row in mix] if colour else [] for mix in (CAMERA_MIX, PROJECTOR_MIX)]
    path = folder / "scene.toml"
    path.write_text(SCENE.format(camera=mixes[0], projector=mixes[1]), "utf-8")
    return str(path), load_scene(str(path))


@pytest.fixture(scope="module")
def grey_ramps(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Ramps of the grey scene, rendered once; a test that changes them takes a copy."""
    folder = tmp_path_factory.mktemp("grey")
    path, _ = written(folder, colour=False)
    assert main(["render", path, "--ramps", "--out", str(folder / "ramps")]) == 0
    return folder / "ramps"


@some_of("channels", [1, 3])
def test_rendered_ramps_give_both_sheets(
    channels: int, grey_ramps: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Noisy ramps of 10 bits: curves within 1 % of full scale, crosstalk within 0.02 per entry."""
    path, scene = written(tmp_path, colour=channels == 3)
    ramps, out, report = grey_ramps, tmp_path / "sheets.json", tmp_path / "report.json"
    if channels == 3:
        ramps = tmp_path / "ramps"
        assert main(["render", path, "--ramps", "--out", str(ramps)]) == 0
    assert main(["calibrate", str(ramps), "--out", str(out), "--json", str(report)]) == 0
    camera, projector = read_sheets(out)
    true = scene.camera.sheet
    above = int(np.ceil(true.black_level_dn))
    for row in camera.response:
        assert np.abs(np.array(row) - true.response[0])[above:].max() < 0.01
    assert len(camera.response) == channels
    assert np.abs(projector.light - scene.projector.sheet.light).max() < 0.01
    assert camera.full_well_e == pytest.approx(true.full_well_e, rel=0.05)
    assert camera.read_noise_e == pytest.approx(true.read_noise_e, rel=0.15)
    assert camera.black_level_dn == pytest.approx(true.black_level_dn, abs=1.0)
    told = capsys.readouterr().out
    assert "full well" in told
    if channels == 3:
        assert np.abs(np.array(camera.crosstalk) - CAMERA_MIX).max() < 0.02
        assert np.abs(np.array(projector.crosstalk) - PROJECTOR_MIX).max() < 0.02
        assert "projector crosstalk" in told
        sigma = np.array(json.loads(report.read_text())["camera_crosstalk_sigma"])
        assert 0.0 < sigma.max() < 0.02


def test_a_ramp_folder_that_is_damaged_says_where(
    grey_ramps: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ramps, asked = tmp_path / "ramps", ["--out", str(tmp_path / "sheets.json")]
    shutil.copytree(grey_ramps, ramps)
    document = json.loads((ramps / "ramps.json").read_text())

    def refused(change: dict[str, object], words: str) -> None:
        (ramps / "ramps.json").write_text(json.dumps(document | change))
        assert main(["calibrate", str(ramps), *asked]) == 2
        assert words in capsys.readouterr().err
        assert not (tmp_path / "sheets.json").exists()

    refused({"bit_depth": 8}, "the camera is said to have 8 bits")
    refused({"levels": []}, "levels: tuple should have at least 1 item")
    refused({"lamps": [{**document["lamps"][0], "lamp": 2}]}, "numbered 0, 1, 2")
    refused({"lamps": document["lamps"][:3]}, "ramp from the dark until it clips")
    far = {**document["lamps"][1], "exposure_ms": 2147483648}
    refused({"lamps": [document["lamps"][0], far]}, "exposed for 2.14748e+09 ms; exposure_range_ms says")
    (ramps / "images" / "0003.png").unlink()
    refused({}, "0003.png: no such image")
    other = shutil.copytree(ramps, tmp_path / "other")
    assert main(["calibrate", str(ramps), str(other), *asked]) == 2
    assert "one folder at a time" in capsys.readouterr().err


def parameters(rig: Rig) -> Floats:
    devices = [[v.fx, v.fy, v.cx, v.cy, *v.distortion[:4]] for v in (rig.camera, rig.projector)]
    turn = cv2.Rodrigues(rig.T_projector_camera[:3, :3])[0].ravel()
    return np.concatenate([*devices, turn, rig.T_projector_camera[:3, 3]])


@pytest.mark.study
def test_boards_of_any_code_recover_the_true_rig(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Capture folders of a bent camera, in XOR code: 22 parameters within their joint uncertainty (z < 4)."""
    path, scene = written(tmp_path, colour=False)
    boards, out, report = tmp_path / "boards", tmp_path / "rig.json", tmp_path / "report.json"
    shown = ["--boards", "5", "--board", "7x5", "--square", "30", "--code", "xor_phase"]
    assert main(["render", path, *shown, "--out", str(boards)]) == 0
    folders = sorted(map(str, boards.iterdir()))
    (Path(folders[0]) / "rig.json").unlink()  # it is what is sought
    asked = ["calibrate", *folders, "--out", str(out)]
    assert main(asked) == 2
    assert "--board 10x7" in capsys.readouterr().err
    assert main([*asked, "--board", "7x5", "--square", "30", "--json", str(report)]) == 0
    found = json.loads(report.read_text())
    assert np.max(found["rms_px"]) < 0.1
    assert len(found["rms_px"]) == 5
    off = np.array(list(found["values"].values())) - parameters(scene.rig.rig())
    distance = off @ np.linalg.solve(np.array(found["covariance"]), off)
    assert distance < len(off) + 4.0 * np.sqrt(2.0 * len(off))
    assert read_rig(out).camera.width == scene.rig.rig().camera.width


def test_a_capture_of_columns_alone_is_no_board(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, _ = written(tmp_path, colour=False)
    capture, asked = (
        tmp_path / "capture",
        ["--board", "7x5", "--square", "30", "--out", str(tmp_path / "rig")],
    )
    assert main(["render", path, "--scan", "fixed", "--out", str(capture)]) == 0
    assert main(["calibrate", str(capture), *asked]) == 2
    assert "capture boards with the strategy 'both'" in capsys.readouterr().err
    assert main(["calibrate", str(tmp_path), *asked]) == 2
    assert "no capture.json" in capsys.readouterr().err


@pytest.mark.study
def test_a_scan_told_measured_sheets_is_as_good(grey_ramps: Path, tmp_path: Path) -> None:
    """Calibrate, scan by what was measured, replay: the same pixels as with the true sheets, within 1 %."""
    path, _ = written(tmp_path, colour=False)
    sheets = str(tmp_path / "sheets.json")
    assert main(["calibrate", str(grey_ramps), "--out", sheets]) == 0
    accepted = {}
    for name, told in (("true", []), ("measured", ["--sheets", sheets])):
        folder, summary = str(tmp_path / name), tmp_path / f"{name}.json"
        assert main(["render", path, "--scan", "fixed", *told, "--out", folder]) == 0
        assert main(["scan", folder, "--json", str(summary)]) == 0
        accepted[name] = json.loads(summary.read_text())["accepted"]
    assert accepted["measured"] == pytest.approx(accepted["true"], rel=0.01)
    # the camera's sheet alone may change afterwards: patterns depend on the projector's
    assert main(["scan", str(tmp_path / "measured"), "--sheets", sheets]) == 0
