"""Plain phase-shift folders: any frequencies, steps and order decode by their manifest alone."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from bench.cli import main
from burrscan import InputError
from burrscan.arrays import Floats
from burrscan.captures.folder import write_rig
from burrscan.captures.phase_folder import decode_phase_capture, is_phase_folder, read_phase_folder
from tests.burrscan.instrument import small_rig

WIDTH, HEIGHT = 200, 120
MANIFEST: dict[str, Any] = {
    "format": "burrscan-phase-steps",
    "version": 1,
    "projector": {"width": WIDTH, "height": HEIGHT},
    "columns": {"frequencies": [1, 5, 25], "steps": 4},
}


def write_folder(
    folder: Path, *, noise: float = 1.0, left: float = 3.0, **changes: Any
) -> tuple[Floats, Floats]:
    """A board before the projector, 60×50 pixels; true columns and rows. Sines are written out here again."""
    manifest = MANIFEST | changes
    rows, columns = np.mgrid[:50, :60].astype(float)
    u, v = left + 3.2 * columns + 0.05 * rows, 2.0 + 2.3 * rows
    frames = []
    for name, place, extent in (("columns", u, WIDTH), ("rows", v, HEIGHT)):
        axis = manifest.get(name)
        if axis is None:
            continue
        sign = -1.0 if axis.get("shift", "forward") == "forward" else 1.0
        steps, start = axis["steps"], np.radians(axis.get("start_deg", 0.0))
        grid = [[(f, n) for n in range(steps)] for f in axis["frequencies"]]
        if manifest.get("order") == "step":
            grid = [list(column) for column in zip(*grid, strict=True)]
        for f, n in (pair for some in grid for pair in some):
            phase = 2.0 * np.pi * (f * place / extent + sign * n / steps) + start
            frames.append(20.0 + 90.0 * (1.0 + np.cos(phase)))
    rng = np.random.default_rng(1)
    folder.mkdir(exist_ok=True)
    for i, frame in enumerate(frames):
        picture = np.clip(np.rint(frame + noise * rng.standard_normal(frame.shape)), 0, 255).astype(np.uint8)
        cv2.imwrite(str(folder / f"shot{i:03d}.png"), picture)
    (folder / "capture.json").write_text(json.dumps(manifest))
    return u, v


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"order": "step"},
        {"columns": {"frequencies": [1, 5, 25], "steps": 4, "shift": "backward"}},
        {"columns": {"frequencies": [1, 5, 25], "steps": 4, "start_deg": 90.0}},
        {"columns": {"frequencies": [0.9, 4, 20], "steps": 5, "shift": "backward", "start_deg": -90.0}},
        {
            "rows": {"frequencies": [1, 6], "steps": 6},
            "order": "step",
            "columns": {"frequencies": [1, 8], "steps": 6},
        },
        {
            "columns": {"frequencies": [1, 5, 25], "steps": 3},
            "camera": {"full_well_e": 1e7, "read_noise_e": 39e3},
        },
    ],
)
def test_what_the_manifest_says_is_what_is_decoded(tmp_path: Path, changes: dict[str, Any]) -> None:
    u, v = write_folder(tmp_path, **changes)
    assert is_phase_folder(tmp_path)
    found = decode_phase_capture(read_phase_folder(tmp_path))
    assert found.mask.mean() > 0.9
    off = np.abs(found.u_px - u)[found.mask]
    assert off.max() < 1.0
    assert np.median(off / found.sigma_u_px[found.mask]) == pytest.approx(0.6745, rel=0.25)
    if "rows" in changes:
        assert found.v_px is not None
        assert np.abs(found.v_px - v)[found.mask].max() < 1.0
    else:
        assert found.v_px is None


def test_the_wrong_manifest_is_not_believed(tmp_path: Path) -> None:
    """Stripes that move the other way, or another order: hardly a pixel's frequencies agree."""
    u, _ = write_folder(tmp_path)
    for change in ({"order": "step"}, {"columns": MANIFEST["columns"] | {"shift": "backward"}}):
        (tmp_path / "capture.json").write_text(json.dumps(MANIFEST | change))
        found = decode_phase_capture(read_phase_folder(tmp_path))
        right = found.mask & (np.abs(found.u_px - u) < 1.0)
        assert right.mean() < 0.1


def test_noise_is_measured_where_it_is_not_stated(tmp_path: Path) -> None:
    write_folder(tmp_path, noise=3.0, columns={"frequencies": [1, 5, 25], "steps": 8})
    camera = read_phase_folder(tmp_path).camera
    assert float(camera.noise_dn(np.array(110.0))) == pytest.approx(3.0, rel=0.15)


def test_at_the_border_noise_does_not_name_the_other(tmp_path: Path) -> None:
    """One period over the width: its phase at the left border is that at the right one.

    At 5.1 periods the finer phase at column 0.5 is that of column 196.6 as well, and contradicts nothing.
    """
    u, _ = write_folder(tmp_path, noise=7.0, left=0.5, columns={"frequencies": [1, 5.1], "steps": 4})
    found = decode_phase_capture(read_phase_folder(tmp_path))
    assert found.mask.mean() > 0.5
    assert not (found.mask & (np.abs(found.u_px - u) > 100.0)).any()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"columns": {"frequencies": [4, 16], "steps": 4}}, "rising, the first of them 1 or less"),
        ({"columns": {"frequencies": [1, 5, 25], "steps": 3}}, "three steps leave nothing"),
        ({"columns": {"frequencies": [1, 5], "stesp": 4}}, "did you mean 'steps'"),
    ],
)
def test_manifests_that_cannot_be_used_say_why(tmp_path: Path, changes: dict[str, Any], message: str) -> None:
    write_folder(tmp_path)
    (tmp_path / "capture.json").write_text(json.dumps(MANIFEST | changes))
    for number in range(9, 12):
        if changes["columns"].get("steps") == 3:
            (tmp_path / f"shot{number:03d}.png").unlink()
    with pytest.raises(InputError, match=message):
        read_phase_folder(tmp_path)


def test_a_missing_picture_is_counted(tmp_path: Path) -> None:
    write_folder(tmp_path)
    (tmp_path / "shot005.png").unlink()
    with pytest.raises(InputError, match=r"11 pictures, but capture\.json speaks of 12"):
        read_phase_folder(tmp_path)


def test_the_command_scans_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_folder(tmp_path, projector={"width": WIDTH, "height": HEIGHT})
    assert main(["scan", str(tmp_path)]) == 0
    assert "3 frequencies × 4 steps" in capsys.readouterr().out
    assert main(["scan", str(tmp_path), "--ply", str(tmp_path / "x.ply")]) == 2
    assert "--rig" in capsys.readouterr().err
    write_rig(tmp_path / "rig.json", small_rig(width=96))
    assert main(["scan", str(tmp_path), "--ply", str(tmp_path / "x.ply")]) == 2
    assert "camera has 96×76 pixels, the capture's 60×50" in capsys.readouterr().err
