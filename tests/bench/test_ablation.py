"""Leaving a step out changes what it does and nothing else, and the table says for sure what got worse."""

import importlib
import inspect
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench.ablation.__main__ import main
from bench.ablation.measure import WHOLE, Seen, measured
from bench.ablation.steps import STEPS, Step
from bench.ablation.table import markdown, rows
from bench.score.metrics import METRICS
from bench.suites.cases import expand
from bench.suites.suite import Suite

CREASES = next(step for step in STEPS if step.name == "creases sharpened")


def standing(step: Step) -> list[Any]:
    """What stands in a step's places."""
    places = [place.split(":") for place in step.places]
    return [getattr(importlib.import_module(module), name) for module, name in places]


@pytest.mark.parametrize("step", STEPS, ids=lambda step: step.name.replace(" ", "-"))
def test_a_step_is_out_only_while_it_is_left_out(step: Step) -> None:
    usual = standing(step)

    def fail() -> None:
        with step.left_out():
            assert standing(step) == list(step.places.values())
            assert all(now is not was for now, was in zip(standing(step), usual, strict=True))
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert all(now is was for now, was in zip(standing(step), usual, strict=True))


@pytest.mark.parametrize("step", STEPS, ids=lambda step: step.name.replace(" ", "-"))
def test_what_stands_in_for_a_step_takes_what_the_step_takes(step: Step) -> None:
    for usual, instead in zip(standing(step), step.places.values(), strict=True):
        if not callable(instead) or isinstance(instead, np.ufunc):
            continue
        taken = inspect.signature(usual).parameters.values()
        positional = [
            None for one in taken if one.kind <= one.POSITIONAL_OR_KEYWORD and one.default is one.empty
        ]
        keywords = {one.name: None for one in taken if one.kind == one.KEYWORD_ONLY}
        inspect.signature(instead).bind(*positional, **keywords)


def test_a_step_that_the_pipeline_has_not_is_an_error_that_leaves_everything_as_it_was() -> None:
    usual = standing(CREASES)
    gone = Step("gone", "burrs", {**CREASES.places, "burrscan.burrs.residual:no_such_step": None})
    with pytest.raises(AttributeError, match="no_such_step"), gone.left_out():
        pass
    assert standing(CREASES)[0] is usual[0]


def made(case: int, step: str, found: tuple[bool, ...], **metrics: float) -> Seen:
    return Seen(f"seed={case}", step, dict.fromkeys(METRICS, 0.5) | metrics, found)


def test_the_table_tells_what_got_worse_from_what_noise_moves() -> None:
    rng, seen = np.random.default_rng(1), []
    useful, idle, harmful = STEPS[:3]
    for case in range(24):
        base = {"axis_deg": float(rng.exponential()), "coverage": 0.9, "burr_height_mm": 0.2}
        seen.append(made(case, WHOLE, (True, True), **base))
        lost = (True, case != 7)
        seen.append(made(case, useful.name, lost, **(base | {"axis_deg": base["axis_deg"] + 0.3})))
        moved = base | {"axis_deg": base["axis_deg"] + float(rng.normal(0.0, 0.1))}
        seen.append(made(case, idle.name, (True, True), **moved))
        seen.append(made(case, harmful.name, (True, True), **(base | {"burr_height_mm": 0.1})))
    table = rows(seen, [useful, idle, harmful])
    assert [row.earns_its_place for row in table] == [True, False, False]
    assert [(row.lost, row.won) for row in table] == [(1, 0), (0, 0), (0, 0)]
    (change,), (), (gain,) = (row.changes for row in table)
    assert (change.metric, change.worse) == ("axis_deg", True)
    assert change.value == pytest.approx(0.3)
    assert (gain.metric, gain.worse) == ("burr_height_mm", False)
    assert gain.value == pytest.approx(-0.1)
    assert change.probability < 1e-4
    lines = markdown(table).splitlines()
    assert "axis angle +0.3 deg" in lines[2]
    assert lines[3].endswith("| – | – |")


SUITE = Suite(
    name="tiny",
    title="",
    description="",
    scene={"wheel": "paper", "finish": "matte", "rig": {"scale": 0.2}},
    variant=(),
)


@pytest.mark.study
def test_a_step_left_out_of_a_scan_is_seen_and_measured_once(tmp_path: Path) -> None:
    bias = next(step for step in STEPS if step.name == "bias of the known light taken off")
    cases, told = expand(SUITE), list[str]()
    first = measured(cases, [CREASES], tmp_path / "kept.json", progress=told.append)
    both = measured(cases, [CREASES, bias], tmp_path / "kept.json", progress=told.append)
    assert told == [cases[0].id, cases[0].id]
    assert [one.step for one in both] == [WHOLE, CREASES.name, bias.name]
    assert both[:2] == first
    whole, creases, biased = both
    assert biased.metrics["axis_deg"] != whole.metrics["axis_deg"]
    assert creases.metrics["axis_deg"] == whole.metrics["axis_deg"]
    measured(cases, [CREASES, bias], tmp_path / "kept.json", progress=told.append)
    assert len(told) == 2


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["quick", "--step", "no such step"], "no step has"),
        (["axis"], "no scenes to scan"),
        (["quik"], "quick"),
    ],
)
def test_bad_input_ends_with_one_line(
    arguments: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*arguments, "--out", str(tmp_path / "a.json")]) == 2
    shown = capsys.readouterr()
    assert said in shown.err
    assert shown.out == ""
    assert not (tmp_path / "a.json").exists()


def test_a_file_that_holds_something_else_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = tmp_path / "other.json"
    other.write_text('{"format": "burrscan-run"}', "utf-8")
    assert main(["quick", "--case", "finish=matte,seed=0", "--out", str(other)]) == 2
    assert "holds no ablation" in capsys.readouterr().err
    assert other.read_text("utf-8") == '{"format": "burrscan-run"}'
