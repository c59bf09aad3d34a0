"""One trial: damage one file of a sound folder, run the command that reads it, judge how it ended."""

from __future__ import annotations

import contextlib
import io
import os
import random
import shutil
import warnings
from dataclasses import dataclass
from pathlib import Path

from bench.checks.fuzz.sound import RAN
from bench.checks.fuzz.targets import TARGETS, Target
from bench.cli import main

_ODD = 0.3
"""Share of trials with an option of no sense, of the targets that know some."""


@dataclass(frozen=True)
class Ending:
    """How a trial ended: ``refused``, ``answered``, or what it must not be, with the last line said."""

    target: str
    kind: str
    said: str = ""

    @property
    def bad(self) -> bool:
        """Whether it ended as nothing may."""
        return self.kind not in {"refused", "answered"}


def trial(number: int, *, sound: Path, work: Path) -> Ending:
    """The ``number``-th trial: the same number, the same damage.

    Parameters
    ----------
    number
        Which; targets take turns.
    sound
        The folder that :func:`bench.checks.fuzz.sound.write_sound` wrote; it is left alone.
    work
        A folder of the trial's own, which is made and removed.

    """
    draw, target = random.Random(number), TARGETS[number % len(TARGETS)]  # noqa: S311 (no secret)
    shutil.copytree(sound, work)
    here = Path.cwd()
    try:
        command = target.command
        if target.odd and draw.random() < _ODD:
            command += draw.choice(target.odd)
        else:
            _damage(target, work, draw)
        before = _names(work)
        os.chdir(work)
        ending = _judged(target, work, _run(command))
        if not target.code and (work / RAN).exists():
            return Ending(ending.target, "ran code", ending.said)
        left = _names(work) - before - {name for pattern in target.left for name in _matching(work, pattern)}
        if ending.kind == "refused" and left:
            return Ending(ending.target, "half-written", f"{min(left)}; {ending.said}")
        return ending
    finally:
        os.chdir(here)
        shutil.rmtree(work)


def _damage(target: Target, work: Path, draw: random.Random) -> None:
    """Damage one of the files or folders that the target names: its bytes, or itself."""
    path = draw.choice(
        sorted(work.glob(target.file)) or sorted(work.glob(f"capture/**/{Path(target.file).name}"))
    )
    if target.upsets and (path.is_dir() or draw.random() < 1.0 / len(target.upsets)):
        draw.choice(target.upsets)(path, draw)
    else:
        path.write_bytes(draw.choice(target.damage)(path.read_bytes(), draw))


def _names(work: Path) -> set[str]:
    """Every file and folder there is."""
    return _matching(work, "**/*")


def _matching(work: Path, pattern: str) -> set[str]:
    return {str(path.relative_to(work)) for path in work.glob(pattern)}


def _run(command: tuple[str, ...]) -> tuple[int, str, str]:
    """Exit code, standard output and errors of a command in this process."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            code = main(command)
        except SystemExit as ended:
            code = ended.code if isinstance(ended.code, int) else 1
    return code, out.getvalue(), err.getvalue()


def _judged(target: Target, work: Path, ended: tuple[int, str, str]) -> Ending:
    code, out, err = ended
    name, last = f"{target.command[0]} {target.file}", (err.strip().splitlines() or [""])[-1]
    if "Traceback" in err or code == 3:
        return Ending(name, "traceback", last)
    if code == 2 and (err.strip() or code not in target.codes):
        return Ending(name, "refused" if err.strip() else "silent", last)
    if code not in target.codes:
        return Ending(name, f"exit {code}", last)
    wrong = target.check(work, out)
    return Ending(name, "wrong answer" if wrong else "answered", wrong)
