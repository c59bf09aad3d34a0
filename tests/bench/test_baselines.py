"""Accepted runs: small, readable as runs, numbered; their history."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

from bench.baselines import accept, accepted, history, newest
from bench.cli import main
from bench.cli.run import hopeless_variants
from bench.compare import compare_runs
from bench.run.directory import load_run
from burrscan.errors import InputError
from tests.bench.compare_runs import with_failure, written_run


def test_an_accepted_run_is_small_and_compares_as_the_run_did(tmp_path: Path) -> None:
    run = written_run(tmp_path / "run")
    (tmp_path / "run" / "cases").mkdir()
    path = accept(run, baselines=tmp_path / "baselines", note="first")
    assert path.parent == tmp_path / "baselines" / "tiny"
    assert {item.name for item in path.iterdir()} == {"run.json", "records.jsonl"}
    assert "command" not in load_run(path).manifest["sessions"][0]
    assert compare_runs(load_run(path), run).exit_code == 0


def test_tracebacks_stay_behind(tmp_path: Path) -> None:
    path = accept(with_failure(written_run(tmp_path / "run"), 2), baselines=tmp_path / "b")
    failure = load_run(path).records[2].failure
    assert failure is not None
    assert (failure.error, failure.traceback) == ("ValueError: no light", "")


def test_the_newest_is_the_one_accepted_last(tmp_path: Path) -> None:
    run = written_run(tmp_path / "run")
    first, second = (accept(run, baselines=tmp_path / "b") for _ in range(2))
    assert first.name < second.name
    assert newest(tmp_path / "b" / "tiny") == second
    assert newest(first) == first
    assert [r.directory.path for r in accepted("tiny", baselines=tmp_path / "b")] == [first, second]


def test_what_cannot_be_accepted(tmp_path: Path) -> None:
    run = written_run(tmp_path / "run")
    path = accept(run, baselines=tmp_path / "b")
    with pytest.raises(InputError, match="accepted run already"):
        accept(load_run(path), baselines=tmp_path / "b")
    some = replace(run, manifest={**run.manifest, "only": "finish=turned,*"})
    with pytest.raises(InputError, match="only some"):
        accept(some, baselines=tmp_path / "b")
    records = tmp_path / "run" / "records.jsonl"
    records.write_text("\n".join(records.read_text().splitlines()[:-1]) + "\n")
    with pytest.raises(InputError, match="1 record"):
        accept(load_run(tmp_path / "run"), baselines=tmp_path / "b")


def _axis_of(number: int, _case: int, metrics: dict[str, float]) -> dict[str, float]:
    return {**metrics, "axis_deg": 0.01 * number}


def test_history(tmp_path: Path) -> None:
    for number in (1, 2):
        run = written_run(tmp_path / str(number), change=partial(_axis_of, number))
        accept(run, baselines=tmp_path / "b", note=f"step {number}")
    points = history("axis_deg", "tiny", baselines=tmp_path / "b")
    assert [point.values["mine"] for point in points] == pytest.approx([0.01, 0.02])
    assert [point.note for point in points] == ["step 1", "step 2"]
    assert points[1].moved["mine"][0] == "worse"
    assert points[1].moved["mine"][1] == pytest.approx(0.01)
    assert (points[0].moved, points[0].halves["mine"]) == ({}, (0.01, 0.01))
    assert history("depth_rms_mm", "tiny", baselines=tmp_path / "b")[1].moved == {}
    assert math.isnan(history("band_mm", "tiny", baselines=tmp_path / "b")[0].values["mine"])
    with pytest.raises(InputError, match="did you mean"):
        history("axis_degs", "tiny", baselines=tmp_path / "b")
    with pytest.raises(InputError, match="no accepted run"):
        history("axis_deg", "other", baselines=tmp_path / "b")


def test_the_commands(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    written_run(tmp_path / "run")
    options = ["--baselines", str(tmp_path / "b")]
    assert main(["accept", str(tmp_path / "run"), *options]) == 0
    assert main(["history", "coverage", "--suite", "tiny", *options]) == 0
    assert "91.88" in capsys.readouterr().out
    assert main(["compare", str(tmp_path / "b" / "tiny"), str(tmp_path / "run")]) == 0


def test_a_variant_without_any_result_is_named(tmp_path: Path) -> None:
    run = written_run(tmp_path / "run", variant=[{"name": "a"}, {"name": "b"}])
    assert hopeless_variants(run) == []
    for number, record in enumerate(run.records):
        run = with_failure(run, number) if record.variant == "b" else run
    assert hopeless_variants(run) == ["b"]
