"""The statistics by themselves: against other implementations, brute force, and each other."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import permutation_test, wilcoxon

from bench.compare.holm import holm, holm_levels
from bench.compare.result import Row
from bench.compare.verdict import ALPHA, Draft, decide, judged
from bench.statistics.flips import DRAWN, FlipTest, mean_test, rank_test
from burrscan.arrays import Floats

VALUES = st.one_of(
    st.floats(-2.0, 2.0, allow_nan=False).map(lambda v: round(v, 3)),
    st.sampled_from([0.0, 0.0, 0.1, -0.1, 0.5, 1.0]),  # ties, and scenes in which nothing changed
    st.sampled_from([280.0, -1e4, 1e-6]),  # cases that can carry a mean
)
Make = Callable[[Floats], FlipTest]
SCENES = st.lists(VALUES, max_size=12).map(lambda values: np.array(values, dtype=float))


def test_holm_by_hand() -> None:
    assert holm(np.array([0.01, 0.04, 0.03, 0.005])) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm(np.array([])).size == 0
    levels = holm_levels(np.array([0.01, 0.04, 0.03, 0.005]), 0.05)
    assert levels == pytest.approx([0.05 / 3, 0.05 / 2, 0.05 / 2, 0.05 / 4])


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=12))
def test_holm_lies_between_raw_and_bonferroni_and_keeps_the_order(p_values: list[float]) -> None:
    raw = np.array(p_values)
    adjusted = holm(raw)
    assert np.all(adjusted >= raw)
    assert np.all(adjusted <= np.minimum(raw * len(raw), 1.0) + 1e-12)
    assert np.all(np.diff(adjusted[np.argsort(raw)]) >= 0.0)


@given(st.lists(st.floats(0.0, 0.2), min_size=1, max_size=12))
def test_holms_levels_reject_what_holms_p_values_do(p_values: list[float]) -> None:
    raw = np.array(p_values)
    near = np.abs(holm(raw) - ALPHA) < 1e-12  # a product and a quotient may round to either side
    assert np.all(((raw <= holm_levels(raw, ALPHA)) == (holm(raw) <= ALPHA)) | near)


def brute_force(scenes: Floats, centre: float) -> float:
    """The share of all choices of signs whose sum is as far from zero as the one seen."""
    left = scenes - centre
    signs = np.array(list(itertools.product((1.0, -1.0), repeat=len(left))))
    return float(np.mean(np.abs(signs @ left) >= abs(left.sum()) - 1e-9 * np.abs(left).max(initial=1e-300)))


@pytest.mark.parametrize("count", [1, 2, 5, 8, 11])
@pytest.mark.parametrize("centre", [0.0, 0.2, -1.0])
def test_the_mean_test_against_brute_force(count: int, centre: float) -> None:
    scenes = np.random.default_rng(count).normal(0.4, 1.0, count)
    assert mean_test(scenes).p(centre) == pytest.approx(brute_force(scenes, centre))


def test_the_mean_test_against_scipy() -> None:
    scenes = np.array([0.3, 0.0, -0.1, 0.8, 0.8, 0.4, 0.2, 0.0, 12.0])
    theirs = permutation_test((scenes,), np.sum, permutation_type="samples", n_resamples=1000)  # all 512
    assert mean_test(scenes).p() == pytest.approx(theirs.pvalue)


@pytest.mark.parametrize("count", [1, 4, 9, 20, 40])
def test_the_rank_test_against_scipy(count: int) -> None:
    scenes = np.random.default_rng(count).normal(0.3, 1.0, count)
    assert rank_test(scenes).p() == pytest.approx(wilcoxon(scenes, method="exact").pvalue)


def test_hodges_and_lehmann_by_hand() -> None:
    assert rank_test(np.array([1.0, 2.0, 9.0])).value == pytest.approx(3.5)  # of 1, 1.5, 2, 5, 5.5, 9
    assert mean_test(np.array([1.0, 2.0, 9.0])).value == pytest.approx(4.0)


def test_beyond_enumeration_signs_are_drawn_and_agree_with_the_normal_limit() -> None:
    scenes = np.random.default_rng(0).normal(0.3, 1.0, 60)
    test = mean_test(scenes)
    z = abs(scenes.sum()) / math.sqrt((scenes**2).sum())
    assert test.drawn == DRAWN
    assert test.p() == pytest.approx(math.erfc(z / math.sqrt(2.0)), abs=0.004)
    assert test.p() == mean_test(scenes).p()  # always the same ones
    assert mean_test(scenes[:20]).drawn == 0


def test_few_scenes_have_no_interval_at_a_level_that_no_test_can_reach() -> None:
    scenes = np.array([1.0, 1.1, 0.9, 1.2, 1.0])
    for test in (mean_test(scenes), rank_test(scenes)):
        assert test.p() == pytest.approx(2.0 / 32.0)
        assert test.interval(0.05) == (-math.inf, math.inf)
        assert test.interval(0.07)[0] > 0.0
    assert mean_test(np.zeros(0)).interval(0.05) == (-math.inf, math.inf)
    assert math.isnan(rank_test(np.zeros(0)).p())


def test_records_that_are_the_same_leave_no_doubt() -> None:
    for test in (mean_test(np.zeros(12)), rank_test(np.zeros(12))):
        assert (test.p(), test.interval(0.005)) == (1.0, (0.0, 0.0))


@settings(max_examples=200, deadline=None)
@given(SCENES, st.floats(1e-4, 0.5), st.floats(-3.0, 3.0), st.sampled_from([mean_test, rank_test]))
def test_the_interval_is_the_test_turned_round(
    scenes: Floats, alpha: float, centre: float, make: Make
) -> None:
    """A centre lies in the interval just where the test at that level does not reject it."""
    test: FlipTest = make(scenes)
    if not len(scenes):
        return
    low, high = test.interval(alpha)
    assert low <= high
    for place in (centre, 0.0, low, high, *scenes[:3]):
        if math.isfinite(place):
            assert (low <= place <= high) == (test.p(place) > alpha)
    if math.isfinite(low):
        step = 1e-6 * max(abs(low), abs(high), 1.0)
        assert test.p(low - step) <= alpha or test.p(low - step) < test.p(low)


def row(margin: float, better: str) -> Row:
    return Row("m", "M", "mm", better, gated=True, margin=margin, tested=True)  # type: ignore[arg-type]


@settings(max_examples=200, deadline=None)
@given(
    st.lists(SCENES, min_size=1, max_size=6),
    st.sampled_from([0.0, 0.05, 1.0]),
    st.sampled_from(["lower", "higher"]),
    st.sampled_from([mean_test, rank_test]),
)
def test_verdict_and_interval_never_contradict_each_other(
    family: list[Floats], margin: float, better: str, make: Make
) -> None:
    """Finding 2: of whole families of gated metrics, with ties, few cases and outliers."""
    tests: list[FlipTest] = [make(scenes) for scenes in family]
    rows = judged([Draft(row(margin, better), test) for test in tests])
    adjusted = holm(np.array([test.p() for test in tests if test.speaks]))
    for told, test in zip(rows, tests, strict=True):
        if not test.speaks:
            assert told.verdict == ("equivalent" if test.scenes else "inconclusive")
    known = [told for told, test in zip(rows, tests, strict=True) if test.speaks]
    for told, p in zip(known, adjusted, strict=True):
        without_zero = told.low > 0.0 or told.high < 0.0
        within_margin = -margin <= told.low and told.high <= margin
        assert (told.verdict == "equivalent") == within_margin
        assert (told.verdict in {"worse", "better"}) == (without_zero and not within_margin)
        assert without_zero == bool(told.seen)
        if abs(p - ALPHA) > 1e-12:
            assert without_zero == (p <= ALPHA)
        if told.seen:
            assert (told.seen == "better") == ((told.low > 0.0) == (better == "higher"))


@pytest.mark.parametrize("make", [mean_test, rank_test])
@pytest.mark.parametrize("count", [8, 24])
def test_false_rejections_are_as_rare_as_promised(make: Make, count: int) -> None:
    """With heavy tails and rounding; three standard errors allowed of 1000 trials (100 if drawn)."""
    random = np.random.default_rng(count)
    trials = 100 if make is mean_test and count > 20 else 1000
    drawn = [np.round(random.standard_t(2, count), 1) for _ in range(trials)]
    rejected = np.mean([make(scenes).p() <= ALPHA for scenes in drawn])
    assert rejected <= ALPHA + 3.0 * math.sqrt(ALPHA * (1.0 - ALPHA) / trials)


@pytest.mark.parametrize(
    ("ends", "verdict"),
    [
        ((0.2, 0.8), "equivalent"),
        ((0.2, 2.8), "worse"),
        ((-2.8, -0.2), "better"),
        ((-0.2, 3.2), "inconclusive"),
        ((0.0, 3.2), "inconclusive"),
        ((-math.inf, math.inf), "inconclusive"),
        ((math.nan, math.nan), "inconclusive"),
    ],
)
def test_verdicts(ends: tuple[float, float], verdict: str) -> None:
    assert decide(*ends, margin=1.0, better="lower") == verdict
    swapped = {"worse": "better", "better": "worse"}.get(verdict, verdict)
    assert decide(*ends, margin=1.0, better="higher") == swapped
