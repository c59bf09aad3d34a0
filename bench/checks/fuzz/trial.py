"""One trial: damage one file of a sound folder, run the command that reads it, judge how it ended."""

from __future__ import annotations

import contextlib
import io
import json
import math
import os
import random
import shutil
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.checks.fuzz.mutate import damaged_bytes, damaged_json, damaged_toml
from bench.checks.fuzz.sound import TRUTH
from bench.cli import main
from bench.synthetic.revolution import axis_angle_deg
from burrscan.errors import InputError
from burrscan.meshio import read_mesh

Damage = Callable[[bytes, random.Random], bytes]
Check = Callable[[Path, str], str]


@dataclass(frozen=True)
class Target:
    """A file to damage, the command that then reads its folder, and what a right answer must hold.

    ``codes`` are the exit codes of an answer.
    """

    file: str
    command: tuple[str, ...]
    check: Check
    damage: tuple[Damage, ...] = (damaged_bytes,)
    codes: tuple[int, ...] = (0,)


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


def _printed(_: Path, text: str) -> str:
    return "" if text.strip() else "printed nothing"


def _inspected(folder: Path, _: str) -> str:
    axis = json.loads((folder / "out.json").read_text("utf-8"))["axis"]
    numbers = [*axis["direction"], *axis["point_mm"]]
    if any(number is None or not math.isfinite(number) for number in numbers):
        return "the axis is no number"
    if abs(math.hypot(*axis["direction"]) - 1.0) > 1e-6:
        return "the axis is no unit vector"
    true = json.loads((folder / TRUTH).read_text("utf-8"))
    off_deg = axis_angle_deg(np.array(axis["direction"]), np.array(true))
    sure = not axis["undetermined"] and off_deg > max(_GROSS_DEG, _SIGMAS * axis["sigma_deg"])
    return f"the axis is {off_deg:.1f} degrees off, stated to {axis['sigma_deg']:.2g}" if sure else ""


def _scanned(folder: Path, _: str) -> str:
    counted = json.loads((folder / "out.json").read_text("utf-8"))["points"]
    return _finite(folder) if counted else "no points"


def _finite(folder: Path, _: str = "") -> str:
    """What is wrong with the mesh written, read back."""
    try:
        read_mesh(folder / "out.ply")
    except InputError as error:
        return f"a mesh that cannot be read: {error}"
    return ""


def _page(folder: Path, _: str) -> str:
    page = (folder / "run" / "report.html").read_bytes()
    return "control characters in the page" if b"\0" in page or b"\x1b" in page else ""


_GROSS_DEG, _SIGMAS = 1.0, 5.0
"""An axis is wrong where it is off by more than either and not stated as undetermined."""
_DETECT = ("--json", "out.json", "--ply", "out.ply")
_JSON, _TOML = (damaged_json, damaged_json, damaged_bytes), (damaged_toml, damaged_toml, damaged_bytes)
_SCAN = ("scan", "capture", "--json", "out.json", "--ply", "out.ply")
_COMPARED = (0, 1, 2)
"""Exit codes of a comparison that was made: 2 says, with the rows, that not all of it can be compared."""
_HISTORY = ("axis_deg", "--suite", "tiny", "--baselines", "baselines")

TARGETS = (
    Target("scene.toml", ("show", "suite.toml"), _printed, _TOML),
    Target("suite.toml", ("show", "suite.toml"), _printed, _TOML),
    Target("capture/capture.json", _SCAN, _scanned, _JSON),
    Target("capture/rig.json", _SCAN, _scanned, _JSON),
    Target("capture/*.png", _SCAN, _scanned),
    Target("run/run.json", ("report", "run"), _page, _JSON),
    Target("run/run.json", ("leaderboard", "run"), _printed, _JSON),
    Target("run/records.jsonl", ("report", "run"), _page),
    Target("run/records.jsonl", ("leaderboard", "run"), _printed),
    Target("run/run.json", ("compare", "other", "run"), _printed, _JSON, _COMPARED),
    Target("run/records.jsonl", ("compare", "run", "other"), _printed, codes=_COMPARED),
    Target("baselines/**/run.json", ("history", *_HISTORY), _printed, _JSON),
    Target("baselines/**/records.jsonl", ("history", *_HISTORY), _printed),
    Target("sheets.json", (*_SCAN, "--sheets", "sheets.json"), _scanned, _JSON),
    Target("run/run.json", ("accept", "run", "--baselines", "baselines"), _printed, _JSON),
    Target(
        "poses.json",
        ("merge", "mesh.ply", "ascii.ply", "--poses", "poses.json", "--out", "out.ply"),
        _finite,
        _JSON,
    ),
    *(
        Target(name, ("detect", name, *_DETECT), _inspected)
        for name in ("mesh.ply", "mesh.stl", "mesh.obj", "ascii.stl", "ascii.ply")
    ),
)


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
        file = draw.choice(
            sorted(work.glob(target.file)) or sorted(work.glob(f"capture/**/{Path(target.file).name}"))
        )
        damaged = draw.choice(target.damage)(file.read_bytes(), draw)
        file.write_bytes(damaged)
        os.chdir(work)
        return _judged(target, work, _run(target.command))
    finally:
        os.chdir(here)
        shutil.rmtree(work)


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
