"""A small run of the fuzzer (``python -m bench.checks.fuzz`` is the long one)."""

from __future__ import annotations

import json
import random
import shutil
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import bench.checks.fuzz.trial as fuzz
from bench.checks.fuzz.mutate import damaged_csv, damaged_lines, damaged_picture
from bench.checks.fuzz.places import UPSETS
from bench.checks.fuzz.sound import TRUTH, write_sound
from bench.checks.fuzz.targets import TARGETS, Target
from bench.checks.fuzz.trial import trial
from tests.tiers import some_of

_SOUND_SAYS = {"render": "not an empty folder", "run": "no case matches"}
"""Of commands that are given what ends them before anything is rendered."""


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sound")
    write_sound(folder)
    return folder


@some_of("every", [3, 1])
def test_damaged_input_is_refused_or_answered_rightly(every: int, sound: Path, tmp_path: Path) -> None:
    numbers = range(0, len(TARGETS), every)
    endings = [trial(number, sound=sound, work=tmp_path / "trial") for number in numbers]
    assert not [ending for ending in endings if ending.bad]
    assert {ending.kind for ending in endings} == {"refused", "answered"}
    assert not list(tmp_path.iterdir())


def test_a_trial_is_the_same_each_time(sound: Path, tmp_path: Path) -> None:
    once, again = (trial(3, sound=sound, work=tmp_path / name) for name in "ab")
    assert (once.target, once.kind) == (again.target, again.kind)


@pytest.mark.parametrize(
    ("change", "kind"),
    [
        ({"direction": [0.0, 0.0, 1.0]}, "wrong answer"),
        ({"direction": [0.0, 0.0, 1.0], "undetermined": ["tilt"]}, "answered"),
        ({"direction": [0.0, 0.0, 1.0], "sigma_deg": 30.0}, "answered"),
        ({"point_mm": [None, 0.0, 0.0]}, "wrong answer"),
        ({}, "answered"),
    ],
)
def test_an_axis_that_is_off_and_stated_as_certain_is_a_wrong_answer(
    sound: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: dict[str, Any], kind: str
) -> None:
    number = next(k for k, target in enumerate(TARGETS) if target.command[0] == "detect")
    true = json.loads((sound / TRUTH).read_text("utf-8"))
    axis = {"direction": true, "point_mm": [0.0] * 3, "sigma_deg": 0.01, "undetermined": [], **change}

    def answers(_: tuple[str, ...]) -> tuple[int, str, str]:
        Path("out.json").write_text(json.dumps({"axis": axis}), "utf-8")
        return 0, "", ""

    monkeypatch.setattr(fuzz, "_run", answers)
    assert trial(number, sound=sound, work=tmp_path / "trial").kind == kind


def once_each() -> list[Target]:
    """A target of each command line."""
    return list({target.command: target for target in TARGETS}.values())


@pytest.mark.study
@pytest.mark.parametrize("target", once_each(), ids=lambda target: f"{target.command[0]}-{target.file}")
def test_what_is_sound_is_answered_rightly(
    target: Target, sound: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Or every trial would end refused, whatever the damage."""
    monkeypatch.setattr(fuzz, "_damage", lambda *_: None)
    monkeypatch.setattr(fuzz, "_ODD", 0.0)
    ending = trial(TARGETS.index(target), sound=sound, work=tmp_path / "trial")
    if target.command[0] in _SOUND_SAYS and "--resume" not in target.command:
        assert ending.kind == "refused"
        assert _SOUND_SAYS[target.command[0]] in ending.said
    else:
        assert (ending.kind, ending.said) == ("answered", "")


def test_what_a_refusal_leaves_behind_is_noticed(
    sound: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    number = next(k for k, target in enumerate(TARGETS) if target.file == "ramps/ramps.json")

    def leaves(_: tuple[str, ...]) -> tuple[int, str, str]:
        Path(".found.json.7.tmp").touch()
        return 2, "", "burrscan: no"

    monkeypatch.setattr(fuzz, "_run", leaves)
    ending = trial(number, sound=sound, work=tmp_path / "trial")
    assert (ending.kind, ending.bad) == ("half-written", True)
    assert ending.said == ".found.json.7.tmp; burrscan: no"


def test_a_focal_length_that_is_off_and_stated_as_certain_is_a_wrong_answer(
    sound: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    number = next(k for k, target in enumerate(TARGETS) if target.file == "boards/**/*.png")
    rig = json.loads((sound / "arm" / "rig.json").read_text("utf-8"))

    def answered(fx: float, sigma: float) -> str:
        def answers(_: tuple[str, ...]) -> tuple[int, str, str]:
            Path("found.json").write_text(json.dumps(rig | {"camera": rig["camera"] | {"fx": fx}}), "utf-8")
            Path("out.json").write_text(json.dumps({"sigma": {"camera.fx": sigma}}), "utf-8")
            return 0, "", ""

        monkeypatch.setattr(fuzz, "_run", answers)
        return trial(number, sound=sound, work=tmp_path / "trial").kind

    assert answered(rig["camera"]["fx"] * 1.01, 0.1) == "answered"
    assert answered(rig["camera"]["fx"] * 1.5, 100.0) == "answered"
    assert answered(rig["camera"]["fx"] * 1.5, 1.0) == "wrong answer"


@pytest.mark.parametrize("upset", UPSETS, ids=lambda upset: upset.__name__)
@pytest.mark.parametrize("name", ["ramps", "ramps/ramps.json"])
def test_files_and_folders_are_damaged_themselves(upset: Any, name: str, sound: Path, tmp_path: Path) -> None:
    shutil.copytree(sound / "ramps", tmp_path / "ramps")
    path, draw = tmp_path / name, random.Random(5)  # noqa: S311 (no secret)

    def state() -> dict[str, bytes | None]:
        return {
            str(one): one.read_bytes() if one.is_file() else None
            for one in [path, *sorted(tmp_path.rglob("*"))]
            if one.exists()
        }

    before = state()
    upset(path, draw)
    assert state() != before


def test_damaged_pictures_tables_and_lines_are_some_still(sound: Path) -> None:
    picture = (sound / "boards/00/images/0000.png").read_bytes()
    table, lines = (sound / name for name in ("arm/csv/poses.csv", "done/records.jsonl"))
    shapes, tables = set(), set()
    for number in range(40):
        draw = random.Random(number)  # noqa: S311 (no secret)
        image = cv2.imdecode(np.frombuffer(damaged_picture(picture, draw), np.uint8), cv2.IMREAD_UNCHANGED)
        assert image is not None
        shapes.add((image.shape, image.dtype.str))
        tables.add(damaged_csv(table.read_bytes(), draw))
        for line in damaged_lines(lines.read_bytes(), draw).splitlines():
            json.loads(line)
    assert len(shapes) >= 5
    assert len(tables) >= 20
