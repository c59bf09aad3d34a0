"""What the fuzzer found of calibrate, gather and run: files half-written, code named by data, wrong kinds."""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

import pytest

from bench.checks.fuzz.sound import RAN, write_sound
from bench.cli import main
from bench.run.directory import load_run


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sound")
    write_sound(folder)
    return folder


@pytest.fixture
def work(sound: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of everything sound, where the command is run."""
    shutil.copytree(sound, tmp_path / "work")
    monkeypatch.chdir(tmp_path / "work")
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.delitem(sys.modules, "helper", raising=False)
    return tmp_path / "work"


def names(folder: Path) -> set[str]:
    return {str(path) for path in folder.rglob("*")}


@pytest.mark.parametrize(
    "command",
    [
        ["calibrate", "ramps", "--out", "found.json"],
        ["scan", "capture", "--ply", "found.ply"],
        ["detect", "mesh.ply", "--ply", "found.ply"],
        ["merge", "mesh.ply", "ascii.ply", "--poses", "poses.json", "--out", "found.ply"],
    ],
)
def test_of_several_files_all_are_written_or_none(
    command: list[str], work: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = names(work)
    assert main([*command, "--json", "run"]) == 2
    assert "run: is a folder; name a file" in capsys.readouterr().err
    assert names(work) == before
    assert main([*command, "--json", "told.json"]) == 0
    assert names(work) - before == {str(work / "told.json"), str(work / command[-1])}


def test_a_document_is_not_written_where_what_it_tells_of_cannot_be(
    work: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = names(work)
    assert main(["calibrate", "ramps", "--out", "run", "--json", "told.json"]) == 2
    assert "run: is a folder" in capsys.readouterr().err
    assert names(work) == before


def metric_of(work: Path, name: str) -> None:
    for part in ("1", "2"):
        path = work / "parts" / part / "run.json"
        manifest = json.loads(path.read_text("utf-8"))
        manifest["suite"]["metrics"] = [name]
        path.write_text(json.dumps(manifest), "utf-8")


def test_gathered_runs_name_no_code_unless_trusted(work: Path, capsys: pytest.CaptureFixture[str]) -> None:
    metric_of(work, "helper:go")
    asked = ["gather", "parts/1", "parts/2", "--out", "whole"]
    assert main(asked) == 2
    assert "names code, metric 'helper:go'" in capsys.readouterr().err
    assert not (work / RAN).exists()
    assert not (work / "whole").exists()
    assert main([*asked, "--trust"]) == 2  # it is no metric, but it is imported
    assert (work / RAN).exists()


@pytest.mark.parametrize("there", [True, False])
def test_a_run_that_cannot_be_gathered_leaves_what_was_there(there: bool, work: Path) -> None:  # noqa: FBT001
    metric_of(work, "nonsense")
    if there:
        (work / "whole").mkdir()
    before = names(work)
    assert main(["gather", "parts/1", "parts/2", "--out", "whole"]) == 2
    assert names(work) == before


def test_a_gathered_run_is_not_taken_away_by_another_attempt(work: Path) -> None:
    asked = ["gather", "parts/1", "parts/2", "--out", "whole"]
    assert main(asked) == 0
    assert main(asked) == 2
    assert load_run(work / "whole").missing == 0


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"code": 2}, "parameter 'code': input should be a valid string, not 2"),
        ({"code": ["gray"]}, "parameter 'code': input should be a valid string"),
        ({"parameters": "cell"}, "parameter 'parameters'"),
        ({"exposure_ms": "1"}, "parameter 'exposure_ms': input should be a valid number"),
        ({"parameters": {"cell_px": [1]}}, "parameter 'cell_px': input should be a valid integer"),
    ],
)
def test_parameters_of_another_kind_in_a_capture_are_refused(
    parameters: dict[str, object], words: str, work: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = work / "boards" / "00" / "capture.json"
    capture = json.loads(path.read_text("utf-8"))
    capture["scan"]["parameters"] |= parameters
    path.write_text(json.dumps(capture), "utf-8")
    assert main(["scan", "boards/00"]) == 2
    assert words in capsys.readouterr().err


def test_records_that_cannot_be_read_are_not_taken_for_none(
    work: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    records = work / "done" / "records.jsonl"
    records.unlink()
    records.symlink_to(records.name)
    assert main(["run", "--resume", "--out", "done", "--workers", "1"]) == 2
    assert capsys.readouterr().err.strip().endswith("records.jsonl: Too many levels of symbolic links")
