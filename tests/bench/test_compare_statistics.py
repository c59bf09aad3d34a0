"""The statistics by themselves, against published values, other implementations and simulation."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq, minimize_scalar
from scipy.stats import binomtest, ttest_1samp

from bench.compare.holm import holm
from bench.compare.interval import scene_estimate
from bench.compare.mcnemar import mcnemar_exact, tango_interval
from bench.compare.verdict import decide


def test_holm_by_hand() -> None:
    assert holm(np.array([0.01, 0.04, 0.03, 0.005])) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm(np.array([])).size == 0


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=12))
def test_holm_lies_between_raw_and_bonferroni_and_keeps_the_order(p_values: list[float]) -> None:
    raw = np.array(p_values)
    adjusted = holm(raw)
    assert np.all(adjusted >= raw)
    assert np.all(adjusted <= np.minimum(raw * len(raw), 1.0) + 1e-12)
    assert np.all(np.diff(adjusted[np.argsort(raw)]) >= 0.0)


def test_mcnemar_is_the_binomial_test_of_discordant_pairs() -> None:
    assert mcnemar_exact(0, 0) == 1.0
    assert mcnemar_exact(6, 0) == pytest.approx(2.0 * 0.5**6)
    assert mcnemar_exact(1, 5) == pytest.approx(binomtest(1, 6).pvalue)


@pytest.mark.parametrize(("lost", "gained", "pairs"), [(2, 12, 50), (0, 5, 16), (3, 3, 20), (1, 0, 200)])
def test_tango_against_a_constrained_likelihood_found_numerically(lost: int, gained: int, pairs: int) -> None:
    def score(difference: float) -> float:
        """The score statistic with the nuisance share found by a search."""

        def cost(share_lost: float) -> float:
            share_gained = share_lost + difference
            rest = 1.0 - share_lost - share_gained
            logs = [(lost, share_lost), (gained, share_gained), (pairs - lost - gained, rest)]
            return -sum(n * math.log(max(s, 1e-300)) for n, s in logs if n)

        low, high = max(0.0, -difference), (1.0 - difference) / 2.0
        share = minimize_scalar(cost, bounds=(low, high), method="bounded", options={"xatol": 1e-12}).x
        variance = pairs * (2.0 * share + difference * (1.0 - difference))
        return float((gained - lost - pairs * difference) / math.sqrt(variance))

    observed = (gained - lost) / pairs
    low = brentq(lambda d: score(d) - 1.959964, -0.9, observed - 1e-6)
    high = brentq(lambda d: score(d) + 1.959964, observed + 1e-6, 0.9)
    assert tango_interval(lost, gained, pairs) == pytest.approx((low, high), abs=1e-4)


def test_tango_without_discordant_pairs_is_not_certain() -> None:
    low, high = tango_interval(0, 0, 16)
    z2 = 1.959964**2
    assert high == pytest.approx(z2 / (16 + z2), abs=1e-6)
    assert low == pytest.approx(-high)


def test_an_interval_needs_two_scenes() -> None:
    one = scene_estimate(np.array([0.3]))
    assert one.value == 0.3
    assert (one.low, one.high, one.p) == (-math.inf, math.inf, 1.0)
    assert math.isnan(scene_estimate(np.array([])).value)


def test_scenes_that_all_agree_leave_no_doubt() -> None:
    same = scene_estimate(np.zeros(8))
    assert (same.value, same.low, same.high, same.p) == (0.0, 0.0, 0.0, 1.0)
    assert scene_estimate(np.full(8, 29.0)).p == 0.0


@given(st.lists(st.floats(-10.0, 10.0), min_size=2, max_size=12), st.floats(0.1, 100.0))
def test_the_interval_holds_the_mean_and_follows_the_unit(values: list[float], unit: float) -> None:
    scenes = np.array(values)
    here, there = scene_estimate(scenes), scene_estimate(unit * scenes)
    assert here.low <= here.value <= here.high
    assert there.low == pytest.approx(unit * here.low, rel=1e-6, abs=1e-9)


def test_the_p_value_is_students() -> None:
    scenes = np.random.default_rng(0).normal(0.3, 1.0, 9)
    assert scene_estimate(scenes).p == pytest.approx(ttest_1samp(scenes, 0.0).pvalue)


@pytest.mark.parametrize("count", [6, 16])
def test_the_interval_covers_the_mean(count: int) -> None:
    """Nominal 0.95 with normal scenes; three standard errors allowed of 400 trials."""
    random = np.random.default_rng(count)
    trials = [scene_estimate(random.standard_normal(count)) for _ in range(400)]
    covered = np.mean([trial.low <= 0.0 <= trial.high for trial in trials])
    assert covered >= 0.95 - 3.0 * math.sqrt(0.95 * 0.05 / 400)


def test_the_interval_is_better_than_students_where_scenes_are_skewed() -> None:
    random = np.random.default_rng(1)
    samples = random.exponential(size=(300, 8))
    ours = [scene_estimate(sample) for sample in samples]
    covered = np.mean([trial.low <= 1.0 <= trial.high for trial in ours])
    half = 2.3646 * samples.std(axis=1, ddof=1) / math.sqrt(8.0)
    students = np.mean(np.abs(samples.mean(axis=1) - 1.0) <= half)
    assert covered > students
    assert covered >= 0.92 - 3.0 * math.sqrt(0.92 * 0.08 / 300)


@pytest.mark.parametrize(
    ("ends", "p", "verdict"),
    [
        ((0.5, 0.2, 0.8), 0.01, "equivalent"),
        ((1.5, 0.2, 2.8), 0.01, "worse"),
        ((-1.5, -2.8, -0.2), 0.01, "better"),
        ((1.5, 0.2, 2.8), 0.06, "inconclusive"),
        ((1.5, -0.2, 3.2), 0.01, "inconclusive"),
        ((0.0, -math.inf, math.inf), 1.0, "inconclusive"),
        ((math.nan, math.nan, math.nan), 1.0, "inconclusive"),
    ],
)
def test_verdicts(ends: tuple[float, float, float], p: float, verdict: str) -> None:
    assert decide(*ends, p=p, margin=1.0, better="lower") == verdict
    swapped = {"worse": "better", "better": "worse"}.get(verdict, verdict)
    assert decide(*ends, p=p, margin=1.0, better="higher") == swapped
