"""``burrscan scan``: rendered and plain folders, the PLY, and messages."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh

from bench.cli import main
from burrscan.captures import RecordingScanner
from burrscan.captures.document import ScanDocument
from burrscan.captures.folder import write_rig
from burrscan.captures.gray_folder import plain_gray_patterns
from burrscan.captures.png import write_grey
from burrscan.scan.rivals.fixed import scan_fixed
from tests.burrscan.instrument import Instrument, plane_depth, small_rig


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("captures") / "one"
    scanner = Instrument(small_rig(width=96), decades=1.0)
    recorder = RecordingScanner(scanner, folder, scan=ScanDocument("fixed", {"exposure_ms": 2.0}))
    scan_fixed(recorder, exposure_ms=2.0)
    recorder.close()
    return folder


def test_a_capture_becomes_a_mesh_with_sigma(
    recorded: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ply, summary = tmp_path / "scan.ply", tmp_path / "scan.json"
    assert main(["scan", str(recorded), "--ply", str(ply), "--json", str(summary)]) == 0
    told = capsys.readouterr().out
    assert "fixed" in told
    found = json.loads(summary.read_text())
    assert found["accepted"] > 2000
    assert found["points"] > 2000
    assert 0.0 < found["median_sigma_mm"] < 1.0
    assert b"property float sigma_mm" in ply.read_bytes()[:400]
    mesh = trimesh.load(ply, process=False)
    assert len(mesh.vertices) == found["points"]
    assert len(mesh.faces) == found["faces"]
    data = mesh.metadata["_ply_raw"]["vertex"]["data"]
    assert np.median(data["sigma_mm"]) == pytest.approx(found["median_sigma_mm"], rel=1e-5)


def gray_folder(folder: Path) -> Instrument:
    scanner = Instrument(small_rig(width=96), depth=plane_depth, decades=0.5)
    view = scanner.rig.projector
    images = scanner.capture(plain_gray_patterns(width=view.width, height=view.height), 2.0)
    folder.mkdir()
    for i, image in enumerate(images):
        write_grey(folder / f"graycode_{i:02d}.png", image)
    return scanner


def test_a_plain_folder_needs_the_raster_and_takes_a_rig(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, ply = tmp_path / "gray", tmp_path / "scan.ply"
    scanner = gray_folder(folder)
    write_rig(tmp_path / "rig.json", scanner.rig)
    raster = f"{scanner.rig.projector.width}x{scanner.rig.projector.height}"
    assert main(["scan", str(folder)]) == 2
    assert "--gray 1024x768" in capsys.readouterr().err
    assert main(["scan", str(folder), "--gray", raster]) == 0
    assert "accepted" in capsys.readouterr().out
    assert main(["scan", str(folder), "--gray", raster, "--ply", str(ply)]) == 2
    assert "--rig" in capsys.readouterr().err
    asked = ["scan", str(folder), "--gray", raster, "--rig", str(tmp_path / "rig.json"), "--ply", str(ply)]
    assert main(asked) == 0
    points = trimesh.load(ply, process=False).vertices
    off = points[:, 2] - (600.0 + 0.2 * (points[:, 0] - points[:, 1]))
    sigma = trimesh.load(ply, process=False).metadata["_ply_raw"]["vertex"]["data"]["sigma_mm"]
    assert 0.8 < np.sqrt(np.mean(off**2) / np.mean(sigma**2)) < 1.1  # about 4 mm: the projector is small
    assert abs(np.mean(off)) < 0.3


def test_what_cannot_be_scanned_is_one_message(
    recorded: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["scan", str(tmp_path / "none")]) == 2
    assert "no such file" in capsys.readouterr().err
    broken = shutil.copytree(recorded, tmp_path / "broken")
    (broken / "images" / "0003.png").unlink()
    assert main(["scan", str(broken)]) == 2
    told = capsys.readouterr()
    assert "0003.png: no such image" in told.err
    assert "Traceback" not in told.err


def test_a_plain_folder_without_inverses_says_how_its_bits_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "gray"
    scanner = gray_folder(folder)
    raster = f"{scanner.rig.projector.width}x{scanner.rig.projector.height}"
    assert main(["scan", str(folder), "--gray", raster]) == 0
    assert "told by their inverses" in capsys.readouterr().out
    paths = sorted(folder.iterdir())
    kept = [path.read_bytes() for path in [*paths[:-2:2], *paths[-2:]]]
    for path in paths:
        path.unlink()
    for path, picture in zip(paths[: len(kept)], kept, strict=True):
        path.write_bytes(picture)
    assert main(["scan", str(folder), "--gray", raster]) == 0
    assert "no inverses: told by a threshold" in capsys.readouterr().out
