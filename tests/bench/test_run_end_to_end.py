"""The whole path on real rendered images: suite, workers, light, pipeline, score, report, resume."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from bench.cli import main
from bench.run import load_run

SUITE = """
name = "tiny"
[scene]
base = "paper"
rig = { scale = 0.25 }
render = { samples = 4 }
[[scene.burr]]
kind = "axial_ridge"
angle_deg = 5.0
height_mm = 3.0
width_mm = 5.0
z_start_mm = -10.0
z_end_mm = 12.0
[sweep]
finish = ["ground", "matte"]
[[variant]]
name = "fixed"
scan = "fixed"
[[variant]]
name = "adaptive"
[[variant]]
name = "broken"
scan = { method = "fixed", parameters = { exposure_ms = 1e9 } }
"""


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The same suite run with one worker and with two."""
    folder = tmp_path_factory.mktemp("runs")
    (folder / "tiny.toml").write_text(SUITE)
    for workers in ("1", "2"):
        asked = ["run", str(folder / "tiny.toml"), "--out", str(folder / workers), "--workers", workers]
        assert main(asked) == 0
    return folder / "1", folder / "2"


def test_records_do_not_depend_on_the_number_of_workers(runs: tuple[Path, Path]) -> None:
    one, two = (path / "records.csv" for path in runs)
    assert one.read_bytes() == two.read_bytes()
    manifests = [json.loads((path / "run.json").read_text()) for path in runs]
    for manifest in manifests:
        del manifest["sessions"]
    assert manifests[0] == manifests[1]


def test_every_case_has_a_record_and_most_pixels_are_right(runs: tuple[Path, Path]) -> None:
    run = load_run(runs[0])
    assert run.missing == 0
    rows = list(csv.DictReader((runs[0] / "records.csv").open()))
    assert [(row["case"], row["variant"]) for row in rows] == [r.key for r in run.records]
    sound = [record for record in run.records if record.variant != "broken"]
    assert all(record.failure is None for record in sound), [record.failure for record in sound]
    assert all(record.metrics["coverage"] > 0.5 for record in sound)
    assert all(record.metrics["axis_deg"] < 2.0 for record in sound)
    assert {"wheel", "transport", "scan", "surface", "axis", "generatrix", "burrs"} <= set(sound[0].timings_s)


def test_a_variant_that_raises_is_a_failure_that_counts(runs: tuple[Path, Path]) -> None:
    broken = [record for record in load_run(runs[0]).records if record.variant == "broken"]
    assert len(broken) == 2
    assert all(
        r.failure and "exposure" in r.failure.error and "Traceback" in r.failure.traceback for r in broken
    )
    assert all(record.metrics["coverage"] == 0.0 for record in broken)


def test_pictures_are_kept_as_documented(runs: tuple[Path, Path]) -> None:
    record = load_run(runs[0]).records[0]
    folder = runs[0] / "cases" / record.case
    truth, found = np.load(folder / "truth.npz"), np.load(folder / f"{record.variant}.npz")
    assert truth["unrolled_mm"].shape == found["unrolled_mm"].shape
    assert np.nanmax(truth["unrolled_mm"]) == pytest.approx(3.0, abs=0.5)
    assert found["pixels"].shape == found["depth_error_mm"].shape == truth["measurable"].shape
    assert truth["burr_height_mm"] == pytest.approx([3.0], abs=0.01)
    assert (runs[0] / "report.html").stat().st_size > 10_000


def test_a_torn_run_is_resumed_by_the_same_command(
    runs: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    torn = tmp_path / "torn"
    shutil.copytree(runs[0], torn)
    lines = (torn / "records.jsonl").read_text().splitlines(keepends=True)
    (torn / "records.jsonl").write_text("".join(lines[:3]) + lines[3][:50])
    assert main(["run", "--resume", "--out", str(torn), "--workers", "1"]) == 0
    assert "tiny: 1/2" in capsys.readouterr().err
    assert (torn / "records.csv").read_bytes() == (runs[0] / "records.csv").read_bytes()
