"""A small run of the fuzzer (``python -m bench.checks.fuzz`` is the long one)."""

from __future__ import annotations

from pathlib import Path

import pytest

from bench.checks.fuzz.sound import write_sound
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
