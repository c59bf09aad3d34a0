"""``--json -``: of every command that has it, standard output is one JSON document and nothing else."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from bench.cli import main
from bench.cli.grammar import actions_of, subcommands_of
from bench.cli.program import parser
from burrscan.captures import RecordingScanner
from burrscan.captures.document import ScanDocument
from burrscan.ply import write_ply
from burrscan.scan.rivals.fixed import scan_fixed
from tests.bench.compare_runs import written_run
from tests.bench.rod import rod_view
from tests.burrscan.instrument import Instrument, small_rig
from tests.burrscan.registration.views import view
from tests.burrscan.test_calibration_board import calibrated, synthetic
from tests.tiers import some_of

Words = Callable[[Path, pytest.MonkeyPatch], list[str]]


def _compare(folder: Path, _: pytest.MonkeyPatch) -> list[str]:
    for name in ("a", "b", "c"):
        written_run(folder / name)
    files = ["--html", str(folder / "x.html"), "--csv", str(folder / "x.csv")]
    return ["compare", *(str(folder / name) for name in ("a", "b", "c")), *files]


def _history(folder: Path, _: pytest.MonkeyPatch) -> list[str]:
    written_run(folder / "run")
    assert main(["accept", str(folder / "run"), "--baselines", str(folder / "b")]) == 0
    return ["history", "axis_deg", "--suite", "tiny", "--baselines", str(folder / "b")]


def _run(folder: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    def quick(*_: object, **__: object) -> None:
        written_run(folder / "run")

    monkeypatch.setattr("bench.run.runner.run_suite", quick)
    monkeypatch.setattr("bench.run.cost_model.update_cost_model", lambda *_, **__: None)
    return ["run", "quick", "--out", str(folder / "run")]


def _detect(folder: Path, _: pytest.MonkeyPatch) -> list[str]:
    rod_view().export(folder / "rod.stl")
    return ["detect", str(folder / "rod.stl"), "-v", "--ply", str(folder / "x.ply")]


def _scan(folder: Path, _: pytest.MonkeyPatch) -> list[str]:
    scanner = Instrument(small_rig(width=96), decades=1.0)
    recorder = RecordingScanner(scanner, folder / "one", scan=ScanDocument("fixed", {"exposure_ms": 2.0}))
    scan_fixed(recorder, exposure_ms=2.0)
    recorder.close()
    return ["scan", str(folder / "one")]


def _merge(folder: Path, _: pytest.MonkeyPatch) -> list[str]:
    rng, poses = np.random.default_rng(4), []
    for name, turn in (("0.ply", 0.0), ("1.ply", 70.0)):
        one = view(turn, rng, robot_mm=0.0, robot_deg=0.0)
        write_ply(folder / name, one.vertices_mm, one.faces, scalars={"sigma_mm": one.sigma_mm})
        poses.append(one.T_world_camera.tolist())
    (folder / "poses.json").write_text(json.dumps({"sigma_mm": 0.4, "T_world_camera": poses}))
    files = [str(folder / name) for name in ("0.ply", "1.ply")]
    return ["merge", *files, "--poses", str(folder / "poses.json"), "--out", str(folder / "all.ply")]


def _calibrate(folder: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    def found(*_: object, **__: object) -> tuple[object, list[str]]:
        return calibrated(synthetic(0)), ["one that was left out"]

    monkeypatch.setattr("bench.cli.calibrate._captures", lambda *_: ([], (1280, 1024), (1024, 768)))
    monkeypatch.setattr("burrscan.calibration.geometric.calibrate_captures", found)
    return ["calibrate", str(folder), "--board", "9x6", "--square", "20", "--out", str(folder / "rig.json")]


def _plain(*words: str) -> Words:
    return lambda _folder, _monkeypatch: list(words)


CALLS: dict[str, Words] = {
    "doctor": _plain("doctor"),
    "run": _run,
    "compare": _compare,
    "history": _history,
    "suites": _plain("suites"),
    "show": _plain("show", "quick"),
    "scan": _scan,
    "calibrate": _calibrate,
    "merge": _merge,
    "detect": _detect,
}


def test_every_command_with_json_is_called_here() -> None:
    tree = subcommands_of(parser())
    having = {n for n, one in tree.items() if any("--json" in a.option_strings for a in actions_of(one))}
    assert having == set(CALLS)


@some_of("command", sorted(CALLS, key=lambda name: name == "suites"), first=len(CALLS) - 1)
def test_standard_output_is_one_document(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    words = CALLS[command](tmp_path, monkeypatch)
    capsys.readouterr()

    def refused(word: str) -> None:
        raise AssertionError(f"{word} is no JSON")

    assert main([*words, "--json", "-"]) == 0
    told = capsys.readouterr()
    document = json.loads(told.out, parse_constant=refused)
    assert document
    assert not (tmp_path / "-").exists()
    assert main([*words, "--json", str(tmp_path / "to.json")]) == 0
    written = json.loads((tmp_path / "to.json").read_text("utf-8"), parse_constant=refused)
    assert type(written) is type(document)
    said = capsys.readouterr().out
    assert not said.startswith("{")
    if command not in {"doctor", "suites", "show"}:  # which print one or the other
        assert said.splitlines()[0] in told.err.splitlines()
