"""What a look of several asks of the finder."""

from __future__ import annotations

from typing import Any

import pytest

from burrscan.burrs import burrs_residual
from burrscan.cell import loop, servo
from burrscan.cell.look import of_several
from burrscan.errors import InputError
from burrscan.pipeline import Pipeline, Stage, stage_function
from tests.burrscan.cell.parts import burr
from tests.burrscan.cell.test_servo import World


def test_the_default_finder_is_told_that_other_looks_decide() -> None:
    for pipeline in (None, Pipeline(), Pipeline(burrs=Stage("residual", {"widest_mm": 5.0}))):
        told = of_several(pipeline)
        given = (pipeline or Pipeline()).burrs.parameters
        assert told.burrs.parameters == {**given, "several_views": True}
        finder: Any = stage_function(told.burrs, "burrs")
        assert finder.func is burrs_residual
        assert finder.keywords["several_views"] is True


def test_what_somebody_chose_stays() -> None:
    for stage in (Stage("seed"), Stage("residual", {"several_views": False})):
        assert of_several(Pipeline(burrs=stage)).burrs == stage


@pytest.mark.parametrize("module", [loop, servo])
def test_looking_around_and_servoing_ask_so(module: object, monkeypatch: pytest.MonkeyPatch) -> None:
    """A look that drops what may be a scratch lost the thin burrs: 36 of 36 became 27."""
    asked: list[Pipeline] = []

    def run(_scanner: object, pipeline: Pipeline) -> None:
        asked.append(pipeline)
        raise InputError("nothing to see")

    monkeypatch.setattr(module, "run", run)
    station, target = World(0).station(), burr(180.0)
    if module is servo:
        servo.servo(station, target, target.T_mesh_burr.copy())
    else:
        with pytest.raises(InputError, match="nothing to see"):
            list(loop.look_around(station, most=1))
    assert asked
    assert all(pipeline == of_several(None) for pipeline in asked)
