"""The command line: help, exit codes, messages without tracebacks."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from bench.cli import COMMANDS, main


@pytest.mark.parametrize("command", COMMANDS)
def test_every_subcommand_has_help(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main([command, "--help"])
    assert caught.value.code == 0
    assert f"burrscan {command}" in capsys.readouterr().out


def test_help_imports_nothing_heavy() -> None:
    code = "import sys; from bench.cli import parser; parser().format_help(); print(*sys.modules)"
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
    assert "16 cases × 2 variants" in capsys.readouterr().out
    assert main(["show", "quick", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["name"] == "quick"


def test_resuming_nothing_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["run", "--resume"]) == 2
    assert "no unfinished run" in capsys.readouterr().err
