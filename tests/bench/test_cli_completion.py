"""Completion as the shells themselves do it: each script is sourced by its shell, and words are completed."""

from __future__ import annotations

import os
import pty
import re
import select
import shutil
import subprocess
import time
from pathlib import Path

import pytest

from bench.cli import main
from bench.cli.completion import bash, fish, zsh
from bench.cli.program import COMMANDS, parser
from tests.tiers import some_of

WORDS = [
    ("burrscan de", "detect", "run"),
    ("burrscan -q de", "detect", "run"),
    ("burrscan --vers", "--version", "run"),
    ("burrscan detect --li", "--limit", "--list"),
    ("burrscan -q detect --li", "--limit", "--list"),
    ("burrscan run qui", "quick", "quiet"),
    ("burrscan show stan", "standard", "quick"),
    ("burrscan completion z", "zsh", "bash"),
    ("burrscan compare a b --only wo", "worse", "better"),
    ("burrscan detect whee", "wheel.stl", "quick"),
    ("burrscan scan x --ply whee", "wheel.stl", "quick"),
]
"""What is typed, a word that must be offered, and one that must not."""


def shell(name: str) -> str:
    found = shutil.which(name)
    if not found:
        pytest.skip(f"no {name} on this machine")
    return found


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a mesh and the three scripts."""
    (tmp_path / "wheel.stl").touch()
    for name, script in (("bash", bash), ("zsh", zsh), ("fish", fish)):
        (tmp_path / f"script.{name}").write_text(script(parser()), "utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path))
    return tmp_path


def test_every_shell_knows_every_command_and_option(capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("bash", "zsh", "fish"):
        assert main(["completion", name]) == 0
        script = capsys.readouterr().out
        assert all(command in script for command in COMMANDS)
        assert "limit" in script
        assert "standard" in script


@pytest.mark.parametrize(("typed", "offered", "other"), WORDS)
def test_bash_completes(typed: str, offered: str, other: str, here: Path) -> None:
    words = typed.split(" ")
    line = f"COMP_WORDS=({' '.join(words)}); COMP_CWORD={len(words) - 1}; _burrscan"
    default = (
        f'[ ${{#COMPREPLY[@]}} -eq 0 ] && COMPREPLY=($(compgen -f -- "{words[-1]}"))'  # complete -o default
    )
    code = "\n".join([f". {here / 'script.bash'}", line, default, 'echo "${COMPREPLY[@]}"'])
    run = subprocess.run([shell("bash"), "-c", code], capture_output=True, text=True, check=True)  # noqa: S603
    assert offered in run.stdout.split()
    assert other not in run.stdout.split()
    assert run.stderr == ""


@pytest.mark.parametrize(("typed", "offered", "other"), WORDS)
def test_fish_completes(typed: str, offered: str, other: str, here: Path) -> None:
    code = f"source {here / 'script.fish'}; complete -C '{typed}'"
    run = subprocess.run(  # noqa: S603
        [shell("fish"), "--no-config", "-c", code], capture_output=True, text=True, check=True
    )
    words = [line.partition("\t")[0] for line in run.stdout.splitlines()]
    assert offered in words
    assert other not in words
    assert run.stderr == ""


def test_fish_offers_no_file_for_a_number(here: Path) -> None:
    code = f"source {here / 'script.fish'}; complete -C 'burrscan detect x.stl --limit '"
    run = subprocess.run(  # noqa: S603
        [shell("fish"), "--no-config", "-c", code], capture_output=True, text=True, check=True
    )
    assert run.stdout == ""


@some_of(("typed", "offered", "other"), WORDS)
def test_zsh_completes(typed: str, offered: str, other: str, here: Path) -> None:
    told = typed_into_zsh(shell("zsh"), here / "script.zsh", typed)
    assert re.split(r"\s+", told.strip())[-1] == offered
    assert other not in told.split()


def typed_into_zsh(path: str, script: Path, typed: str) -> str:
    """The command line after the tabulator, as an interactive zsh shows it."""
    child, terminal = pty.fork()
    if child == 0:
        os.environ |= {"TERM": "dumb", "PS1": "READY> "}
        os.execv(path, ["zsh", "-f", "-i"])  # noqa: S606 (a shell is what is tested)
    try:
        _until(terminal, "READY> ")
        os.write(terminal, f"PS1=; source {script}; PS1='DO''NE> '\n".encode())
        _until(terminal, "DONE> ")
        os.write(terminal, f"{typed}\t".encode())
        return _until(terminal, None)
    finally:
        os.close(terminal)  # hangs up: an interactive shell ends
        os.waitpid(child, 0)


def _until(terminal: int, mark: str | None, *, patience_s: float = 20.0, quiet_s: float = 1.0) -> str:
    """What the terminal shows up to a mark; without one, until it is quiet."""
    told, end = "", time.monotonic() + patience_s
    while time.monotonic() < end:
        ready = select.select([terminal], [], [], quiet_s)[0]
        if ready:
            told += os.read(terminal, 65536).decode("utf-8", "replace")
        elif mark is None and told:
            return told
        if mark is not None and mark in told:
            return told
    raise AssertionError(f"zsh shows only {told!r}")
