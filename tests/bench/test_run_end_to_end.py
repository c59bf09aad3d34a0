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
def run_dir(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The suite, run with one worker."""
    folder = tmp_path_factory.mktemp("runs")
    (folder / "tiny.toml").write_text(SUITE)
    asked = ["run", str(folder / "tiny.toml"), "--out", str(folder / "run"), "--workers", "1"]
    assert main(asked) == 0
    return folder / "run"


def test_every_case_has_a_record_and_most_pixels_are_right(run_dir: Path) -> None:
    run = load_run(run_dir)
    assert run.missing == 0
    rows = list(csv.DictReader((run_dir / "records.csv").read_text().splitlines()))
    assert [(row["case"], row["variant"]) for row in rows] == [r.key for r in run.records]
    sound = [record for record in run.records if record.variant != "broken"]
    assert all(record.failure is None for record in sound), [record.failure for record in sound]
    assert all(record.metrics["coverage"] > 0.5 for record in sound)
    assert all(record.metrics["axis_deg"] < 2.0 for record in sound)
    assert {"wheel", "transport", "scan", "surface", "axis", "generatrix", "burrs"} <= set(sound[0].timings_s)


def test_a_variant_that_raises_is_a_failure_that_counts(run_dir: Path) -> None:
    broken = [record for record in load_run(run_dir).records if record.variant == "broken"]
    assert len(broken) == 2
    assert all(
        r.failure and "exposure" in r.failure.error and "Traceback" in r.failure.traceback for r in broken
    )
    assert all(record.metrics["coverage"] == 0.0 for record in broken)


def test_pictures_are_kept_as_documented(run_dir: Path) -> None:
    record = load_run(run_dir).records[0]
    folder = run_dir / "cases" / record.case
    truth, found = (dict(np.load(folder / f"{name}.npz")) for name in ("truth", record.variant))
    assert truth["unrolled_mm"].shape == found["unrolled_mm"].shape
    assert np.nanmax(truth["unrolled_mm"]) == pytest.approx(3.0, abs=0.5)
    assert found["pixels"].shape == found["depth_error_mm"].shape == truth["measurable"].shape
    assert truth["burr_height_mm"] == pytest.approx([3.0], abs=0.01)
    assert (run_dir / "report.html").stat().st_size > 10_000


def test_a_torn_run_is_finished_by_two_workers_with_the_same_records(
    run_dir: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    torn = tmp_path / "torn"
    shutil.copytree(run_dir, torn)
    lines = (torn / "records.jsonl").read_text().splitlines(keepends=True)
    (torn / "records.jsonl").write_text("".join(lines[:3]) + lines[3][:50])
    assert main(["run", "--resume", "--out", str(torn), "--workers", "2"]) == 0
    assert "tiny: 1/2" in capsys.readouterr().err
    assert (torn / "records.csv").read_bytes() == (run_dir / "records.csv").read_bytes()
    one, two = (json.loads((path / "run.json").read_text()) for path in (run_dir, torn))
    assert len(one.pop("sessions")) == 1
    assert len(two.pop("sessions")) == 2
    assert one == two
