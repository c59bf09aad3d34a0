"""A burr called on a blemish is a false call, and counts for the blemish's kind."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from bench.score import Evidence
from bench.score.blemishes import KINDS
from bench.score.metrics import measure_some
from burrscan.inspection import Burr
from scenes.surface import TrueBlemish
from tests.bench.ideal import evidence, found_burr, true_burr

STAIN = TrueBlemish("stain", 100.0, 4.0, -10.0, 0.0, 10.0, 7.0)
SCRATCH = TrueBlemish("scratch", 110.0, 1.0, -10.0, 10.0, 20.0, 0.1)
CHATTER = TrueBlemish("chatter", 0.0, 360.0, 5.0, 12.0, 7.0, 600.0)
HIT = found_burr(90.0, (-10.0, 10.0))
NAMES = ("false_calls", "blemish_calls", *(f"calls_{kind}" for kind in KINDS))


def counts(*found: Burr, blemishes: tuple[TrueBlemish, ...] = (STAIN, SCRATCH, CHATTER)) -> list[float]:
    seen = evidence(true_burr(), found=found)
    return list(
        measure_some(Evidence(replace(seen.truth, blemishes=blemishes), seen.outcome), NAMES).values()
    )


@pytest.mark.parametrize(
    ("call", "expected"),
    [
        (HIT, [0, 0, 0, math.nan, 0, 0]),
        (found_burr(104.9, (-6.0, -2.0)), [1, 1, 1, math.nan, 0, 0]),  # 2.9 degrees off the stain's edge
        (found_burr(106.0, (-6.0, -2.0)), [1, 0, 0, math.nan, 0, 0]),
        (found_burr(100.0, (1.0, 4.0)), [1, 0, 0, math.nan, 0, 0]),  # beside it along the axis
        (found_burr(111.0, (6.0, 9.0)), [1, 1, 0, math.nan, 0, 1]),  # on the chatter, near the scratch
        (found_burr(110.2, (6.0, 9.0)), [1, 1, 0, math.nan, 1, 0]),  # on both: the narrower
        (found_burr(60.0, (7.0, 9.0)), [1, 1, 0, math.nan, 0, 1]),
    ],
)
def test_a_false_call_counts_for_the_blemish_it_is_on(call: Burr, expected: list[float]) -> None:
    assert counts(call) == pytest.approx(expected, nan_ok=True)


def test_several_calls_add_up_and_a_hit_on_a_stained_burr_is_a_hit() -> None:
    over = replace(STAIN, angle_deg=90.0)
    found = counts(
        HIT, found_burr(110.2, (6.0, 9.0)), found_burr(30.0, (-9.0, -5.0)), blemishes=(over, SCRATCH)
    )
    assert found == pytest.approx([2, 1, 0, math.nan, 1, math.nan], nan_ok=True)


def test_without_blemishes_there_is_nothing_to_count() -> None:
    assert counts(HIT, blemishes=())[1:] == pytest.approx([math.nan] * 5, nan_ok=True)
