"""Detection curves against known curves, and the published 29-of-29 rule."""

from __future__ import annotations

import html
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.special import expit
from scipy.stats import norm

from bench.detection import (
    detection,
    detections,
    fit_hit_miss,
    fit_signal,
    sections,
)
from bench.detection.curve import PodCurve
from bench.detection.records import of_one_size
from bench.report import build_detection
from bench.run.records import Failure, Record
from bench.statistics.share import share_bounds
from burrscan.arrays import Bools, Floats
from burrscan.errors import InputError

MIDDLE, SLOPE = math.log(0.5), 0.35
A90 = math.exp(MIDDLE + SLOPE * math.log(9.0))


def simulated(random: np.random.Generator, count: int) -> tuple[Floats, Bools]:
    """Burrs of 0.1 to 3 mm, found as a logistic curve in log size says."""
    size = np.exp(random.uniform(math.log(0.1), math.log(3.0), count))
    return size, random.random(count) < expit((np.log(size) - MIDDLE) / SLOPE)


def responses(random: np.random.Generator, count: int) -> tuple[Floats, Floats]:
    """Measured sizes that follow the true ones in log-log, reported from 0.4 mm upwards."""
    size = np.exp(random.uniform(math.log(0.1), math.log(3.0), count))
    log = 0.9 * np.log(size) - 0.1 + 0.3 * random.standard_normal(count)
    return size, np.where(log >= math.log(0.4), np.exp(log), np.nan)


def share_within(z: float, nominal: float, trials: int) -> float:
    """The least share that is no further than z standard errors below the nominal coverage."""
    return nominal - z * math.sqrt(nominal * (1.0 - nominal) / trials)


def test_29_of_29_show_0_90() -> None:
    assert share_bounds(29, 29, sides=1)[0] == pytest.approx(0.05 ** (1 / 29))
    assert share_bounds(29, 29, sides=1)[0] == pytest.approx(0.902, abs=5e-4)
    assert share_bounds(28, 28, sides=1)[0] < 0.9
    assert share_bounds(0, 5)[0] == 0.0
    assert share_bounds(0, 5)[1] == pytest.approx(1.0 - 0.025 ** (1 / 5))


@pytest.mark.study
def test_hit_miss_intervals_cover_as_stated() -> None:
    random, trials = np.random.default_rng(0), 120
    fits = [fit_hit_miss(*simulated(random, 120)) for _ in range(trials)]
    two = np.mean([fit.a90_interval[0] <= A90 <= fit.a90_interval[1] for fit in fits])
    one = np.mean([fit.a90_95 >= A90 for fit in fits])
    band = np.mean([_band_holds(fit, expit((np.log(fit.size) - MIDDLE) / SLOPE)) for fit in fits], axis=0)
    assert min(two, one, *band) >= share_within(3.0, 0.95, trials)
    assert np.median([fit.a90 for fit in fits]) == pytest.approx(A90, rel=0.05)


@pytest.mark.study
def test_signal_intervals_cover_as_stated() -> None:
    random, trials = np.random.default_rng(1), 150
    fits = [fit_signal(*responses(random, 150), threshold=0.4) for _ in range(trials)]
    truth = math.exp((math.log(0.4) + 0.3 * norm.ppf(0.9) + 0.1) / 0.9)
    two = np.mean([fit.a90_interval[0] <= truth <= fit.a90_interval[1] for fit in fits])
    one = np.mean([fit.a90_95 >= truth for fit in fits])
    band = np.mean(
        [_band_holds(f, norm.cdf((0.9 * np.log(f.size) - 0.1 - math.log(0.4)) / 0.3)) for f in fits], axis=0
    )
    assert min(two, one, *band) >= share_within(3.0, 0.95, trials)


def _band_holds(fit: PodCurve, truth: Floats) -> Bools:
    return np.asarray((fit.low <= truth) & (truth <= fit.high))[[20, 40, 60]]


def test_the_fit_is_the_maximum_of_the_likelihood() -> None:
    """Against the score equations of logistic regression, which need no optimiser."""
    size, hit = simulated(np.random.default_rng(2), 300)
    fit = fit_hit_miss(size, hit)
    slope = math.log(9.0) / math.log(fit.a90 / fit.a50)
    residual = hit - expit(slope * (np.log(size) - math.log(fit.a50)))
    assert abs(residual.sum()) < 1e-2
    assert abs((residual * np.log(size)).sum()) < 1e-2


@pytest.mark.study
def test_asymptotes_are_found() -> None:
    random = np.random.default_rng(4)
    size = np.concatenate([np.zeros(60), np.exp(random.uniform(math.log(0.1), math.log(3.0), 160))])
    with np.errstate(divide="ignore"):
        pod = 0.05 + 0.8 * expit((np.log(size) - MIDDLE) / SLOPE)
    fit = fit_hit_miss(size, random.random(220) < pod, floor=True, ceiling=True)
    assert fit.low[-1] <= 0.85 <= fit.high[-1]
    assert fit.low[0] <= 0.05 <= fit.high[0]
    assert fit.high[-1] - fit.low[-1] < 0.3
    assert (fit.trials, fit.a90_95) == (160, math.inf)
    assert np.all((fit.low <= fit.pod + 1e-3) & (fit.pod <= fit.high + 1e-3))


@pytest.mark.parametrize(("hits", "trials", "sides"), [(3, 10, 2), (9, 10, 2), (1, 40, 1), (20, 21, 1)])
def test_at_its_bounds_a_share_is_as_rare_as_the_level_says(hits: int, trials: int, sides: int) -> None:
    """Clopper & Pearson's definition by binomial terms: so many or fewer (or more) have the tail's chance."""

    def chance(share: float, counts: range) -> float:
        return sum(math.comb(trials, k) * share**k * (1.0 - share) ** (trials - k) for k in counts)

    low, high = share_bounds(hits, trials, level=0.9, sides=sides)
    assert chance(high, range(hits + 1)) == pytest.approx(0.1 / sides)
    assert chance(low, range(hits, trials + 1)) == pytest.approx(0.1 / sides)


@pytest.mark.parametrize(
    ("sizes", "one"),
    [
        ([1.0, 1.04], True),
        ([1.06, 1.0], False),
        ([0.5, 0.5], True),
        ([0.0, 0.5, 0.52], True),
        ([0.0], False),
        ([], False),
    ],
)
def test_sizes_within_five_per_cent_are_one_size(sizes: list[float], *, one: bool) -> None:
    assert of_one_size(np.array(sizes)) is one


def test_hidden_burrs_lower_the_ceiling_of_a_signal() -> None:
    random = np.random.default_rng(4)
    size, response = responses(random, 400)
    response[random.random(400) < 0.15] = np.nan
    fit = fit_signal(size, response, threshold=0.4, hidden=True, blanks=(3, 100))
    assert fit.ceiling == pytest.approx(0.85, abs=0.06)
    assert fit.floor == 0.03
    assert math.isinf(fit.a90_95)


def test_what_the_data_do_not_show_is_not_claimed() -> None:
    every = fit_hit_miss(np.repeat([1.0, 2.0], 10), np.ones(20, bool))
    assert math.isnan(every.a90)
    assert math.isinf(every.a90_95)
    apart = fit_hit_miss(np.repeat([0.5, 1.0, 2.0], 30), np.repeat([False, True, True], 30))
    assert 0.5 < apart.a50 < 1.0
    assert 0.5 < apart.a90_95 <= 1.0
    with pytest.raises(InputError, match="two sizes"):
        fit_hit_miss(np.ones(20), np.ones(20, bool))
    with pytest.raises(InputError, match="three burrs"):
        fit_signal(np.array([1.0, 2.0]), np.array([1.0, np.nan]), threshold=0.5)


def records() -> list[Record]:
    """Two variants; the second one misses more, and fails in one case."""
    random = np.random.default_rng(5)
    made = []
    for number in range(60):
        height = float(np.exp(random.uniform(math.log(0.1), math.log(3.0))))
        for variant, middle in (("good", 0.3), ("poor", 0.8)):
            found = bool(random.random() < expit((math.log(height) - math.log(middle)) / 0.3))
            burr = {"height_mm": height, "found": found} | ({"height_error_mm": 0.01} if found else {})
            failure = Failure("pipeline", "E", "") if variant == "poor" and number == 0 else None
            made.append(
                Record(
                    f"c{number}", variant, {"finish": number % 6, "seed": number // 6}, "h", "i",
                    {"false_calls": float(number % 2)}, () if failure else (burr,), failure,
                )
            )  # fmt: skip
    return made


def test_records_become_curves_with_their_false_calls() -> None:
    good, poor = detections(records())
    assert good.curve is not None
    assert poor.curve is not None
    assert good.curve.a90 < poor.curve.a90
    assert (good.false_calls_per_wheel, good.wheels) == (0.5, 60)
    assert (poor.curve.trials, poor.wheels, poor.failed) == (60, 59, 1)
    assert len(detections(records(), by="finish")) == 12
    assert detection(records(), variant="good", model="signal").curve is not None
    assert detection(records(), variant="good", where={"finish": "none"}).curve is None


def test_burrs_of_one_section_are_counted_alone() -> None:
    mixed = [
        replace(
            r, burrs=tuple({**b, "section": "flake" if b["height_mm"] > 1.0 else "rolled"} for b in r.burrs)
        )
        for r in records()
    ]
    parts = [detection(mixed, variant="poor", burrs={"section": name}) for name in sections(mixed)]
    trials = [sum(share.trials for share in part.shares) for part in parts]
    assert sum(trials) == 60
    assert min(trials) > 5
    assert all(share.size > 1.0 for share in parts[list(sections(mixed)).index("flake")].shares)
    assert {part.wheels for part in parts} == {59}
    assert sections(records()) == ()


def test_a_burr_called_without_a_height_is_found_and_has_no_size() -> None:
    """NaN heights are null in records: a report of 'standard' ended in a TypeError."""
    plain = records()
    blank = [
        replace(record, burrs=tuple({**burr, "height_error_mm": None} for burr in record.burrs))
        for record in plain
    ]
    for old, new in zip(detections(plain), detections(blank), strict=True):
        assert old.curve is not None
        assert new.curve is not None
        assert new.curve.a90 == old.curve.a90


def test_the_page_states_false_calls_and_sizes_beside_every_curve(tmp_path: Path) -> None:
    found = detections(records())
    text = build_detection(found, tmp_path / "pod.html").read_text("utf-8")
    pictures = re.findall("<svg class=.plot.*?</svg></svg>|<svg class=.plot.*?</text></svg>", text, re.DOTALL)
    assert sum(picture.count('class="curve"') for picture in pictures) == 2
    rows = re.findall(r"<tr><th><span.*?</tr>", text)
    for item, row in zip(found, rows, strict=True):
        assert item.curve is not None
        assert f">{item.name}<" in row
        assert f"<td>{item.false_calls_per_wheel:.2f}<" in row
        for size in (item.curve.a50, item.curve.a90, item.curve.a90_95):
            assert f"<td>{html.escape(item.curve.told(size))}</td>" in row
    with pytest.raises(InputError, match="nothing to detect"):
        build_detection([], tmp_path / "none.html")


def test_each_variant_has_its_own_finds() -> None:
    def record(variant: str, *, found: bool) -> Record:
        burr = {"found": found, "height_mm": 1.0}
        return Record("c", variant, {"seed": 0}, "", "", {"false_calls": 0.0}, (burr,))

    records = [record("blind", found=False), record("keen", found=True)]
    assert [detection(records, variant=name).shares[0].hits for name in ("blind", "keen")] == [0, 1]
