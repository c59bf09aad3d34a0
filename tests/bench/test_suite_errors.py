"""Every error of a suite's file in one message, of whatever kind: three kinds of typos took three rounds."""

from __future__ import annotations

from pathlib import Path

import pytest

from bench.suites.catalogue import load_suite
from burrscan.errors import InputError

TYPOS = """
name = "typos"
titel = "unknown key"
seeds = "one"
metrics = ["coverage", "covrage"]

[scene]
base = "paper"
finish = "grund"
rig = { skale = 0.5 }

[[variant]]
name = "one"
scan = "fixd"
axis = { method = "profile", parameters = { keep = 3 } }
burr = "residual"

[[variant]]
name = 7

[[gate]]
metric = "axis_dg"

[[goal]]
metric = "burr_fund"
at_least = 1.0
"""
EXPECTED = (
    "titel: unknown key; did you mean 'title'?",
    "seeds",
    "unknown metric 'covrage': did you mean 'coverage'?",
    "unknown scan method 'fixd': did you mean 'fixed'?",
    "unknown parameter 'keep'",
    "burr: unknown key; did you mean 'burrs'?",
    "variant.1.name",
    "gate: unknown metric 'axis_dg'",
    "unknown metric 'burr_fund'",
)
OF_THE_SCENE = (
    "unknown finish 'grund': did you mean 'ground'?",
    "rig.skale: unknown key; did you mean 'scale'?",
)


def message(text: str, folder: Path) -> str:
    path = folder / "suite.toml"
    path.write_text(text, "utf-8")
    with pytest.raises(InputError) as caught:
        load_suite(path)
    return str(caught.value)


def test_every_kind_of_typo_is_said_at_once(tmp_path: Path) -> None:
    told = message(TYPOS, tmp_path)
    assert not [expected for expected in (*EXPECTED, *OF_THE_SCENE) if expected not in told]
    assert told.startswith(f"{tmp_path / 'suite.toml'}: {len(told.splitlines()) - 1} problem(s)")


def test_an_unknown_base_hides_nothing_else(tmp_path: Path) -> None:
    told = message(TYPOS.replace('base = "paper"', 'base = "papr"'), tmp_path)
    assert "unknown scene 'papr': did you mean 'paper'?" in told
    assert not [expected for expected in EXPECTED if expected not in told]


def test_what_follows_from_an_error_is_not_told_as_another(tmp_path: Path) -> None:
    text = 'name = "x"\nsweep = 3\ngroups = ["finish"]\n[scene]\nbase = "paper"\n[[variant]]\nname = "a"\n'
    assert len(message(text, tmp_path).splitlines()) == 2


@pytest.mark.parametrize(
    ("finder", "why"),
    [("json:loads", "cannot be called as"), ("math:hypot", "its signature cannot be read")],
)
def test_a_finder_that_cannot_be_called_is_refused_when_the_suite_is_read(
    finder: str, why: str, tmp_path: Path
) -> None:
    text = f'name = "x"\n[scene]\nbase = "paper"\n[[variant]]\nname = "mine"\nburrs = "{finder}"\n'
    assert f"variant 'mine': burrs method '{finder}': {why}" in message(text, tmp_path)
