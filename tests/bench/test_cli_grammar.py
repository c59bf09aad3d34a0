"""The command line: help, exit codes, messages without tracebacks."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
import trimesh

from bench.cli import main
from bench.cli.program import COMMANDS
from tests.bench.rod import rod_view


@pytest.mark.parametrize("command", COMMANDS)
def test_every_subcommand_has_help(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main([command, "--help"])
    assert caught.value.code == 0
    assert f"burrscan {command}" in capsys.readouterr().out


def test_help_imports_nothing_heavy() -> None:
    code = "import sys; from bench.cli.program import parser; parser().format_help(); print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)  # noqa: S603
    assert not {"mitsuba", "drjit", "numba", "scipy", "matplotlib", "trimesh"} & set(loaded.stdout.split())


def test_version_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["--version"])
    assert caught.value.code == 0
    assert capsys.readouterr().out.startswith("burrscan ")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run", "quik"], "did you mean 'quick'"),
        (["run"], "name a suite"),
        (["run", "missing.toml"], "no such file"),
        (["show", "quik"], "did you mean 'quick'"),
        (["report", "nowhere"], "not a run directory"),
        (["detect", "nowhere.stl"], "nowhere.stl"),
        (["scan", "nowhere"], "no such file"),
        (["render", "papr", "--out", "x"], "did you mean 'paper'"),
    ],
)
def test_bad_input_is_one_message_and_exit_code_2(
    arguments: list[str],
    message: str,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    told = capsys.readouterr()
    assert message in told.err
    assert "Traceback" not in told.err + told.out
    assert list(tmp_path.iterdir()) == []


def test_suites_and_show_say_what_there_is(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["suites"]) == 0
    assert "quick" in capsys.readouterr().out
    assert main(["show", "quick"]) == 0
    assert "28 cases × 2 variants" in capsys.readouterr().out
    assert main(["show", "quick", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["name"] == "quick"


def test_resuming_nothing_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["run", "--resume"]) == 2
    assert "no unfinished run" in capsys.readouterr().err


def test_an_interrupted_run_says_how_to_finish_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("bench.run.runner.run_suite", interrupted)
    assert main(["run", "quick", "--out", str(tmp_path / "r")]) == 130
    assert f"burrscan run --resume --out {tmp_path / 'r'}" in capsys.readouterr().err


def test_detect_prints_and_writes_what_it_found(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rod_view().apply_scale(1e-3).export(tmp_path / "rod.ply")
    found, deviation = tmp_path / "found.json", tmp_path / "deviation.ply"
    asked = ["detect", str(tmp_path / "rod.ply"), "--json", str(found), "--ply", str(deviation)]
    assert main([*asked, "--unit", "m", "--limit", "0.5"]) == 1
    told = capsys.readouterr().out
    assert "axis" in told
    assert "generatrix" in told
    assert abs(json.loads(found.read_text())["axis"]["direction"][2]) > 0.999
    assert b"property float deviation_mm" in deviation.read_bytes()[:400]


def test_detect_doubts_a_mesh_that_is_in_metres(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    trimesh.creation.cylinder(radius=0.1, height=0.05).export(tmp_path / "rod.stl")
    main(["detect", str(tmp_path / "rod.stl")])
    assert "--unit" in capsys.readouterr().err


def test_help_and_readme_name_the_exit_codes_and_trust(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["run", "--help"])
    told = capsys.readouterr().out
    page = (Path(__file__).parents[2] / "README.md").read_text("utf-8")
    for text in (told, page):
        assert "--trust" in text
        assert "3 an error of burrscan's own" in text
        assert "143 terminated" in text
