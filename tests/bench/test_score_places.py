"""A burr's score is that of the place it states, however it states it; none is lost without a word."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bench.score import measure
from bench.score.burrs import burr_tables
from burrscan.inspection import Value
from tests.bench.ideal import evidence, found_burr, true_burr

NOT_STATED = Value(float("nan"), float("nan"))


def test_a_burr_of_which_the_angle_alone_is_known_is_scored_by_it() -> None:
    """Such a detector followed CONTRIBUTING ("or NaN") and scored 0 % without a word."""
    bare = replace(
        found_burr(91.0, (-10.0, 10.0)),
        T_mesh_burr=np.full((4, 4), np.nan), z_start_mm=NOT_STATED, z_end_mm=NOT_STATED, height_mm=NOT_STATED,
    )  # fmt: skip
    scored = measure(evidence(true_burr(), found=(bare,)))
    assert scored["burr_found"] == 1.0
    assert scored["false_calls"] == 0.0
    assert scored["burr_angle_deg"] == pytest.approx(1.0)
    assert np.isnan(scored["burr_height_mm"])
    assert np.isnan(scored["burr_extent_mm"])
    (table,) = burr_tables(evidence(true_burr(), found=(bare,)))
    assert table["found"]


@pytest.mark.parametrize("off_deg", [4.0, 77.0])
def test_an_angle_that_is_off_is_off(off_deg: float) -> None:
    """It scored 0.02 degrees, for the pose was right."""
    bare = replace(found_burr(90.0 + off_deg, (-10.0, 10.0)), T_mesh_burr=np.full((4, 4), np.nan))
    scored = measure(evidence(true_burr(), found=(bare,)))
    assert scored["burr_found"] == 0.0
    assert scored["false_calls"] == 1.0


def test_a_height_that_is_not_stated_spoils_no_other() -> None:
    first, second = true_burr(), true_burr(angle_deg=60.0)
    bare = replace(found_burr(60.0, (-10.0, 10.0)), height_mm=NOT_STATED)
    found = (found_burr(90.0, (-10.0, 10.0), height_mm=1.2), bare)
    assert measure(evidence(first, second, found=found))["burr_height_mm"] == pytest.approx(0.2)


def test_a_burr_called_with_the_wrong_side_is_located_and_not_found() -> None:
    wrong = found_burr(91.0, (-10.0, 10.0), side="nick")
    scored = measure(evidence(true_burr(), found=(wrong,)))
    assert (scored["burr_located"], scored["burr_found"], scored["false_calls"]) == (1.0, 0.0, 1.0)
    beside = found_burr(94.0, (-10.0, 10.0))
    assert measure(evidence(true_burr(), found=(beside,)))["burr_located"] == 0.0
    beyond = found_burr(90.0, (40.0, 50.0))
    assert measure(evidence(true_burr(), found=(beyond,)))["burr_located"] == 0.0
