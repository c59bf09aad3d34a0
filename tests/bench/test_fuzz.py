"""A small run of the fuzzer (``python -m bench.checks.fuzz`` is the long one)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import bench.checks.fuzz.trial as fuzz
from bench.checks.fuzz.sound import TRUTH, write_sound
from bench.checks.fuzz.trial import TARGETS, trial

_TRIALS = 2 * len(TARGETS)


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sound")
    write_sound(folder)
    return folder


def test_damaged_input_is_refused_or_answered_rightly(sound: Path, tmp_path: Path) -> None:
    endings = [trial(number, sound=sound, work=tmp_path / "trial") for number in range(_TRIALS)]
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
