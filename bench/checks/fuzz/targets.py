"""What the fuzzer damages, the command that reads it then, and what a right answer must hold."""

from __future__ import annotations

import json
import math
import random
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.checks.fuzz.boards import BOARD, CAMERA
from bench.checks.fuzz.mutate import (
    damaged_bytes,
    damaged_csv,
    damaged_json,
    damaged_lines,
    damaged_picture,
    damaged_toml,
)
from bench.checks.fuzz.places import UPSETS, Upset
from bench.checks.fuzz.sound import TRUTH
from bench.run.directory import load_run
from bench.synthetic.revolution import axis_angle_deg
from burrscan.captures.folder import read_rig
from burrscan.captures.hand_eye_folder import read_hand_eye
from burrscan.captures.sheets import read_sheets
from burrscan.errors import InputError
from burrscan.meshio import read_mesh

Damage = Callable[[bytes, random.Random], bytes]
Check = Callable[[Path, str], str]


@dataclass(frozen=True)
class Target:
    """A file or folder to damage, the command that then reads it, and what a right answer must hold.

    Parameters
    ----------
    file
        Pattern of what is damaged, in the sound folder.
    command
        Arguments of ``burrscan``.
    check
        Of the folder and what was printed: what is wrong with the answer; empty for a right one.
    damage
        To the bytes of a file, drawn alike.
    upsets
        To the file or folder itself, instead of damage to bytes now and then; a folder has no other.
    odd
        Options of no sense, one of which is added now and then instead of any damage.
    codes
        The exit codes of an answer.
    left
        Patterns of what a refusal may leave behind.
    code
        Whether the user's own file or option may name code; data may not.

    """

    file: str
    command: tuple[str, ...]
    check: Check
    damage: tuple[Damage, ...] = (damaged_bytes,)
    upsets: tuple[Upset, ...] = ()
    odd: tuple[tuple[str, ...], ...] = ()
    codes: tuple[int, ...] = (0,)
    left: tuple[str, ...] = ()
    code: bool = False


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


def _calibrated(folder: Path, _: str) -> str:
    """A camera far from the true one: a board that moved between pictures, or was taken for another."""
    try:
        found = read_rig(folder / "found.json").camera
    except InputError as error:
        return f"a rig that cannot be read: {error}"
    sigma = json.loads((folder / "out.json").read_text("utf-8"))["sigma"]["camera.fx"]
    off = abs(found.fx / CAMERA.fx - 1.0)
    return (
        f"the focal length is {found.fx:.0f} px, stated to {sigma:.2g}"
        if _far(off, sigma / CAMERA.fx)
        else ""
    )


def _photometric(folder: Path, _: str) -> str:
    try:
        camera, projector = read_sheets(folder / "found.json")
    except InputError as error:
        return f"sheets that cannot be read: {error}"
    numbers = [camera.full_well_e, camera.read_noise_e, camera.black_level_dn, *projector.light]
    return "" if all(math.isfinite(number) for number in numbers) else "a sheet with what is no number"


def _on_flange(folder: Path, _: str) -> str:
    try:
        pose, covariance = read_hand_eye(folder / "found.json")
    except InputError as error:
        return f"a calibration that cannot be read: {error}"
    return "" if np.isfinite(pose).all() and np.isfinite(covariance).all() else "what is no number"


def _gathered(folder: Path, text: str) -> str:
    try:
        load_run(folder / "whole")
    except InputError as error:
        return f"a run that cannot be read: {error}"
    return _printed(folder, text)


def _resumed(folder: Path, text: str) -> str:
    if load_run(folder / "done").missing:
        return "records are missing"
    return _printed(folder, text)


def _far(off: float, sigma: float) -> bool:
    return off > max(_FAR, _SIGMAS * sigma)


_GROSS_DEG, _SIGMAS = 1.0, 5.0
"""An axis is wrong where it is off by more than either and not stated as undetermined."""
_FAR = 0.05
"""Of a focal length, beyond five deviations."""
_DETECT = ("--json", "out.json", "--ply", "out.ply")
_CSV, _PICTURES = (damaged_csv, damaged_csv, damaged_bytes), (damaged_picture, damaged_bytes)
_JSON, _TOML = (damaged_json, damaged_json, damaged_bytes), (damaged_toml, damaged_toml, damaged_bytes)
_SCAN = ("scan", "capture", "--json", "out.json", "--ply", "out.ply")
_COMPARED = (0, 1, 2)
"""Exit codes of a comparison that was made: 2 says, with the rows, that not all of it can be compared."""
_BOARD = ("--board", f"{BOARD.columns}x{BOARD.rows}", "--square", f"{BOARD.square_mm:g}")
_FOUND = ("--out", "found.json", "--json", "out.json")
_BOARDS = ("calibrate", *(f"boards/0{k}" for k in range(5)), *_BOARD, *_FOUND)
_GRAY = ("calibrate", *(f"gray/0{k}" for k in range(5)), "--gray", "64x48", *_BOARD, *_FOUND)
_ARM = ("--hand-eye", "--rig", "arm/rig.json", *_BOARD, *_FOUND)
_GATHER = ("gather", "parts/1", "parts/2", "--out", "whole")
_RENDER = ("render", "scene.toml", "--sheets", "sheets.json", "--out", "run")
"""Into a folder that holds something: scene and sheets are read, and nothing is rendered."""
_RUN = ("run", "suite.toml", "--case", "none-of-this-name", "--out", "made")
"""The suite is read and drawn out into cases, and none is run."""
_RESUME = ("run", "--resume", "--out", "done", "--workers", "1", "--json", "out.json")
"""Of a run that is whole: its report is made. What is missing for the damage is rendered, small."""
_OUTS = (
    ("--out", "run"),
    ("--out", "scene.toml"),
    ("--out", "scene.toml/in"),
    ("--out", "x" * 300),
    ("--out", ""),
)
"""Where a folder cannot be made."""
_FILES = (
    ("--out", "run"),
    ("--out", "scene.toml/in"),
    ("--out", "x" * 300),
    ("--json", "run"),
    ("--out", ""),
)
"""Where a file cannot be."""
_ODD_BOARDS = tuple(
    (option, value)
    for option, values in (
        ("--board", ("0x0", "7x-6", "6x7", "200x200", "99999x3", "7", "nan", "7x6x5", "8x8", "3x3")),
        ("--square", ("0", "-1", "nan", "inf", "1e-300", "1e300", "x", "1e-9")),
        ("--distortion", ("-1", "1", "3", "99", "nan")),
    )
    for value in values
)  # fmt: skip
_ODD_RENDERS = (
    ("--seed", "-1"), ("--seed", "1e99"), ("--seed", "nan"), ("--scan", "nothing"), ("--scan", "helper:go"),
    ("--scan", ""), ("--boards", "0"), ("--boards", "-3"), ("--boards", "2", "--board", "1x1"),
    ("--boards", "2", "--square", "nan"), ("--boards", "2", "--square", "0"),
    ("--boards", "1", "--code", "none"), ("--boards", "1", "--ramps"),
    ("--boards", "99999999999999999999"), ("--ramps",), ("--sheets", "run"),
    ("--sheets", "scene.toml"), ("--sheets", ""), *_OUTS[:3],
)  # fmt: skip
_ODD_RUNS = (
    ("--seed", "-1"), ("--seed", "1e99"), ("--workers", "0"), ("--workers", "nan"), ("--case", ""),
    ("--case", "["), ("--shard", "3/2"), ("--shard", "0/1"), ("--shard", "nan/nan"), ("--shard", "1"),
    ("--shard", "1/" + "9" * 400), ("--resume",), ("--resume", "--out", "scene.toml"), ("--store", "x"),
    ("--resources", "GPU=1"), ("--json", "run"), *_OUTS,
)  # fmt: skip
_HISTORY = ("axis_deg", "--suite", "tiny", "--baselines", "baselines")

_WHOLE_RUN = (
    "done/.lock", "done/cases", "done/cases/*", "done/cases/*/*", "done/records.jsonl", "done/records.csv",
    "done/timings.csv", "done/report.html", "out.json",
)  # fmt: skip
"""What a run leaves, and nothing beside: cases whose records were lost are run anew, and all may fail."""
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
    Target("run/run.json", ("compare", "other", "run"), _printed, _JSON, codes=_COMPARED),
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
    Target("boards/**/*.png", _BOARDS, _calibrated, _PICTURES, UPSETS),
    Target("boards/**/capture.json", _BOARDS, _calibrated, _JSON, UPSETS),
    Target("boards/*", _BOARDS, _calibrated, upsets=UPSETS, odd=(*_ODD_BOARDS, *_FILES, ("--gray", "64x48"))),
    Target(
        "gray/*",
        _GRAY,
        _calibrated,
        upsets=UPSETS,
        odd=(
            ("--gray", "0x0"),
            ("--gray", "99999999x99999999"),
            ("--gray", "-1x4"),
            ("--gray", "32x32"),
            *_FILES,
        ),
    ),
    Target("gray/*/*.png", _GRAY, _calibrated, _PICTURES, UPSETS),
    Target("ramps/**/*.png", ("calibrate", "ramps", *_FOUND), _photometric, _PICTURES, UPSETS),
    Target("ramps/ramps.json", ("calibrate", "ramps", *_FOUND), _photometric, _JSON, UPSETS, _FILES),
    Target("arm/*.png", ("calibrate", "arm", *_ARM), _on_flange, _PICTURES, UPSETS),
    Target("arm/poses.json", ("calibrate", "arm", *_ARM), _on_flange, _JSON, UPSETS, (*_ODD_BOARDS, *_FILES)),
    Target("arm/csv/poses.csv", ("calibrate", "arm/csv", *_ARM), _on_flange, _CSV, UPSETS),
    Target("arm/rig.json", ("calibrate", "arm", *_ARM), _on_flange, _JSON, UPSETS),
    Target("parts/*/run.json", _GATHER, _gathered, _JSON, UPSETS, _OUTS),
    Target("parts/*/records.jsonl", _GATHER, _gathered, (damaged_bytes, damaged_lines), UPSETS),
    Target("parts/*", _GATHER, _gathered, upsets=UPSETS, odd=_OUTS),
    Target("scene.toml", _RENDER, _printed, _TOML, UPSETS, _ODD_RENDERS, code=True),
    Target("sheets.json", _RENDER, _printed, _JSON, UPSETS, _ODD_RENDERS, code=True),
    Target("scene.toml", _RUN, _printed, _TOML, UPSETS, _ODD_RUNS, code=True),
    Target("suite.toml", _RUN, _printed, _TOML, UPSETS, _ODD_RUNS, code=True),
    Target("done/run.json", _RESUME, _resumed, _JSON, UPSETS, left=("done/.lock",)),
    Target(
        "done/records.jsonl",
        _RESUME,
        _resumed,
        (damaged_bytes, damaged_lines),
        UPSETS,
        left=_WHOLE_RUN,
    ),
)
"""In turn: the trial's number says which."""
