"""The whole path on real rendered images: suite, workers, light, pipeline, score, report, resume."""

from __future__ import annotations

import csv
import json
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from bench.budget import SUBSTITUTIONS
from bench.cli import main
from bench.run import load_run
from bench.summary.budget import budget_rows

SUITE = """
name = "tiny"
budget = ["shifted", "turned"]
detectability = true
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
[[variant]]
name = "clipped"
scan = { method = "fixed", parameters = { exposure_ms = 200.0 } }
[[variant]]
name = "shifted"
scan = "FAULTS:shifted_projector"
[[variant]]
name = "turned"
scan = "fixed"
axis = { method = "FAULTS:turned_axis", parameters = { by_deg = 2.0 } }
"""

FAULTS = '''
"""A user's own package: stages with a planted fault."""
from dataclasses import replace
import numpy as np
from burrscan.axis.profile import find_axis_profile
from burrscan.scan.rivals.fixed import scan_fixed

def shifted_projector(scanner, *, columns=3.0):
    scan = scan_fixed(scanner)
    moved = replace(scan.correspondence, u_px=scan.correspondence.u_px + np.float32(columns))
    return replace(scan, correspondence=moved)

def turned_axis(vertices, faces, *, sigma_mm=None, by_deg=2.0):
    axis = find_axis_profile(vertices, faces, sigma_mm=sigma_mm)
    angle = np.radians(by_deg)
    turn = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
    return replace(axis, direction=turn @ axis.direction)
'''


@pytest.fixture(scope="module")
def run_dir(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """One case of the suite, run with one worker."""
    yield from finished(tmp_path_factory.mktemp("runs"), "--case", "finish=ground,*")


@pytest.fixture(scope="module")
def whole_run_dir(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The suite, run with one worker."""
    yield from finished(tmp_path_factory.mktemp("whole"))


def finished(folder: Path, *options: str) -> Iterator[Path]:
    faults = f"faults_{os.getpid()}"
    (folder / f"{faults}.py").write_text(FAULTS)
    (folder / "tiny.toml").write_text(SUITE.replace("FAULTS", faults))
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder)
        asked = ["run", str(folder / "tiny.toml"), "--out", str(folder / "run"), "--workers", "1", *options]
        assert main(asked) == 2  # 'broken' has no result in any case
        yield folder / "run"


def test_every_case_has_a_record_and_most_pixels_are_right(run_dir: Path) -> None:
    run = load_run(run_dir)
    assert run.missing == 0
    rows = list(csv.DictReader((run_dir / "records.csv").read_text().splitlines()))
    assert [(row["case"], row["variant"]) for row in rows] == [r.key for r in run.records]
    sound = [record for record in run.records if record.variant in {"fixed", "adaptive"}]
    assert all(record.failure is None for record in sound), [record.failure for record in sound]
    assert all(record.metrics["coverage"] > 0.5 for record in sound)
    assert all(record.metrics["axis_deg"] < 2.0 for record in sound)
    assert {"wheel", "transport", "scan", "surface", "axis", "generatrix", "burrs"} <= set(sound[0].timings_s)


def test_a_variant_that_raises_is_a_failure_that_counts(run_dir: Path) -> None:
    broken = [record for record in load_run(run_dir).records if record.variant == "broken"]
    assert len(broken) == 1
    assert all(
        r.failure and "exposure" in r.failure.error and "Traceback" in r.failure.traceback for r in broken
    )
    # Records leave the machine: files are named from where they are imported.
    assert all(r.failure and 'File "burrscan/pipeline.py"' in r.failure.traceback for r in broken)
    assert {r.failure.stage for r in broken if r.failure} == {"scan"}
    assert all(record.metrics["coverage"] == 0.0 for record in broken)


def test_planted_faults_show_in_the_metrics_of_their_stage(run_dir: Path) -> None:
    run = load_run(run_dir)
    cases = {record.case for record in run.records}
    for case in cases:
        sound, clipped, shifted, turned = (
            next(r.metrics for r in run.records if r.key == (case, variant))
            for variant in ("fixed", "clipped", "shifted", "turned")
        )
        assert clipped["saturated_share"] > sound["saturated_share"] + 0.2
        assert clipped["coverage"] < sound["coverage"] - 0.2
        assert shifted["wrong_rate"] > 0.95
        assert shifted["coverage"] < 0.05
        assert turned["axis_deg"] == pytest.approx(2.0, abs=0.3)
        scan_metrics = ("coverage", "wrong_rate", "depth_rms_mm", "frames", "saturated_share")
        assert [turned[name] for name in scan_metrics] == [sound[name] for name in scan_metrics]


def test_the_budget_lays_each_fault_at_the_door_of_its_stage(run_dir: Path) -> None:
    """Truth substituted from the front: an error goes when the truth of the stage that made it comes in."""
    rows = {(row.variant, row.metric): row for row in budget_rows(load_run(run_dir).records)}
    assert {variant for variant, _ in rows} == {"shifted", "turned"}
    turned = rows["turned", "axis_deg"]
    assert set(turned.left) == set(SUBSTITUTIONS)
    assert turned.cost["axis"] == pytest.approx(2.0, abs=0.05)
    assert abs(turned.cost["decoding"]) < 0.3
    shifted = rows["shifted", "depth_rms_mm"], rows["shifted", "axis_offset_mm"]
    assert shifted[1].cost["decoding"] > 0.5
    assert max(abs(shifted[1].cost[stage]) for stage in ("triangulation", "axis")) < 0.3
    for (_, metric), row in rows.items():
        perfect = 1.0 if metric == "burr_found" else 0.0
        assert row.left["burrs"] == pytest.approx(perfect, abs=1e-5), (row.variant, metric)


def test_a_ridge_of_3_mm_is_told_from_none_and_from_a_nick_and_more_light_tells_more(run_dir: Path) -> None:
    told = {record.key: record.burrs[0] for record in load_run(run_dir).records if record.failure is None}
    assert min(min(burr["dprime"], burr["side_dprime"]) for burr in told.values()) > 100.0
    for case in {case for case, _ in told}:
        assert told[case, "adaptive"]["side_dprime"] > 1.2 * told[case, "fixed"]["side_dprime"]


def test_pictures_are_kept_as_documented(run_dir: Path) -> None:
    record = load_run(run_dir).records[0]
    folder = run_dir / "cases" / record.case
    truth, found = (dict(np.load(folder / f"{name}.npz")) for name in ("truth", record.variant))
    assert truth["unrolled_mm"].shape == found["unrolled_mm"].shape
    assert np.nanmax(truth["unrolled_mm"]) == pytest.approx(3.0, abs=0.5)
    assert found["pixels"].shape == found["depth_error_mm"].shape == truth["measurable"].shape
    assert truth["burr_height_mm"] == pytest.approx([3.0], abs=0.01)
    assert (run_dir / "report.html").stat().st_size > 10_000


@pytest.mark.study
def test_a_torn_run_is_finished_by_two_workers_with_the_same_records(
    whole_run_dir: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    torn = tmp_path / "torn"
    shutil.copytree(whole_run_dir, torn)
    lines = (torn / "records.jsonl").read_text().splitlines(keepends=True)
    (torn / "records.jsonl").write_text("".join(lines[:7]) + lines[7][:50])
    assert (
        main(["run", "--resume", "--trust", "--out", str(torn), "--workers", "2"]) == 2
    )  # 'broken' has no result
    assert "tiny: 1/2" in capsys.readouterr().err
    assert (torn / "records.csv").read_bytes() == (whole_run_dir / "records.csv").read_bytes()
    one, two = (json.loads((path / "run.json").read_text()) for path in (whole_run_dir, torn))
    assert len(one.pop("sessions")) == 1
    assert len(two.pop("sessions")) == 2
    assert one == two


def test_a_rendered_capture_is_scanned_and_inspected_from_its_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = 'wheel = "paper"\nfinish = "matte"\nrig = { scale = 0.2 }\nrender = { samples = 2 }'
    (tmp_path / "scene.toml").write_text(scene)
    folder, mesh, found = tmp_path / "capture", tmp_path / "scan.ply", tmp_path / "found.json"
    assert main(["render", str(tmp_path / "scene.toml"), "--out", str(folder), "--scan", "fixed"]) == 0
    assert main(["scan", str(folder), "--ply", str(mesh)]) == 0
    assert main(["detect", str(mesh), "--json", str(found)]) == 0
    assert "generatrix" in capsys.readouterr().out
    direction = json.loads(found.read_text())["axis"]["direction"]
    truth = dict(np.load(folder / "truth.npz"))["T_part_camera"][2, :3]
    assert abs(float(np.dot(direction, truth))) > np.cos(np.radians(2.0))
