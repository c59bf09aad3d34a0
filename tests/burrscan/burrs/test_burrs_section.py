from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from burrscan.arrays import Floats
from burrscan.burrs.shape import along
from burrscan.burrs.shape.along import _filtered, height_of, highest
from burrscan.burrs.shape.grid_posterior import posterior_of
from burrscan.burrs.shape.patch import Patch
from burrscan.burrs.shape.ridge import first_ridge, fit_ridge
from burrscan.burrs.shape.section import Kind, section

HALVES = st.floats(0.3, 1.5)


@given(
    x=st.floats(-2.5, 2.5), left=HALVES, right=HALVES,
    kind=st.sampled_from(
        [Kind(), Kind(2), Kind(1, 0.2), Kind(1, 0.9), Kind(1, 0.0, 0.4), Kind(1, 0.2, 0.33)]
    ),
)  # fmt: skip
def test_derivatives_are_those_of_the_height(x: float, left: float, right: float, kind: Kind) -> None:
    edges = np.array([-left, -left * kind.blunt, 0.0, right * kind.blunt, right])
    kinks = np.concatenate([edges + share * kind.footprint_mm for share in (-0.5, 0.0, 0.5)])
    if np.abs(x - kinks).min() < 1e-4:
        return
    derived = section(np.array([x]), left, right, kind)[1:]
    e = 1e-6
    for k, step in enumerate(np.eye(3) * e):
        up, down = (
            section(np.array([x + s * step[0]]), left + s * step[1], right + s * step[2], kind)
            for s in (1.0, -1.0)
        )
        assert derived[k] == pytest.approx((up[0] - down[0]) / (2.0 * e), abs=1e-4)


def test_a_footprint_s_mean_of_a_triangle() -> None:
    x = np.linspace(-1.6, 1.9, 30)
    fine = np.linspace(-0.25, 0.25, 2001)
    across = x[:, None] + fine
    triangle = np.clip(1.0 - np.abs(across) / np.where(across < 0.0, 1.1, 1.5), 0.0, None)
    assert section(x, 1.1, 1.5, Kind(1, 0.5))[0] == pytest.approx(triangle.mean(axis=1), abs=1e-3)


def test_a_blunt_triangle_is_written_out() -> None:
    x = np.linspace(-1.6, 1.9, 36)
    q = np.abs(x) / np.where(x < 0.0, 1.1, 1.5)
    expected = np.clip((1.0 - q) / (1.0 - 0.4), 0.0, 1.0)
    assert section(x, 1.1, 1.5, Kind(1, 0.0, 0.4))[0] == pytest.approx(expected, abs=1e-12)


def _columns(
    places: list[float], sigma_mm: float = 0.05, *, footprint: float = 0.0, half: float = 0.5
) -> Patch:
    """Columns of vertices 0.5 mm apart along a burr 2 mm high at v = 0.05 mm, 60 mm long."""
    rng = np.random.default_rng(1)
    u, v = (grid.ravel() for grid in np.meshgrid(np.arange(-30.0, 30.0, 0.5), places))
    lift = 2.0 * section(v - 0.05, half, half, Kind(1, footprint))[0] + sigma_mm * rng.normal(size=len(u))
    return Patch(u, v, lift, np.full(len(u), sigma_mm))


def test_two_columns_leave_the_height_open_three_places_do_not() -> None:
    start = np.array([1.7, 0.0, 0.0, 0.45])
    regular = [-1.3, -0.8, -0.3, 0.2, 0.7, 1.2]
    opened = posterior_of(_columns(regular), start, spacing_mm=0.5, slanted=True)
    known = posterior_of(_columns(sorted([*regular, -0.1, 0.4, 0.45])), start, spacing_mm=0.5, slanted=True)
    assert opened is not None
    assert known is not None
    sigma, known_sigma = np.sqrt(opened.covariance[0, 0]), np.sqrt(known.covariance[0, 0])
    assert sigma > 0.1
    assert abs(opened.mean[0] - 2.0) < 2.0 * sigma
    assert known_sigma < 0.03
    assert abs(known.mean[0] - 2.0) < 4.0 * known_sigma
    assert abs(known.mean[1] - 0.05) < 4.0 * np.sqrt(known.covariance[1, 1])


def test_known_places_reach_the_bound() -> None:
    rng = np.random.default_rng(2)
    pulls, sigmas = [], []
    for _ in range(40):
        u, v = rng.uniform(-30.0, 30.0, 1500), rng.uniform(-1.5, 1.5, 1500)
        lift = 2.0 * section(v, 0.5, 0.5, Kind())[0] + 0.05 * rng.normal(size=1500)
        found = posterior_of(
            Patch(u, v, lift, np.full(1500, 0.05)), np.array([1.5, 0.1, 0.0, 0.7]), spacing_mm=0.5,
            slanted=True,
        )  # fmt: skip
        assert found is not None
        sigmas.append(np.sqrt(found.covariance[0, 0]))
        pulls.append((found.mean[0] - 2.0) / sigmas[-1])
    inside = np.abs(v) < 0.5
    # Cramér-Rao with place, slant and width unknown: of these only the width is correlated with the height.
    shape, by_width = 1.0 - np.abs(v[inside]) / 0.5, 2.0 * np.abs(v[inside]) / 0.5**2
    matrix = np.stack([shape, by_width]) @ np.stack([shape, by_width]).T / 0.05**2
    assert np.median(sigmas) == pytest.approx(np.sqrt(np.linalg.inv(matrix)[0, 0]), rel=0.15)
    assert 0.7 < np.sqrt(np.mean(np.square(pulls))) < 1.35  # 40 pulls: 1 ± 0.11 (one sigma)


@pytest.mark.parametrize("footprint", [0.0, 0.5])
def test_whether_vertices_are_points_or_footprints_is_seen(footprint: float) -> None:
    rng = np.random.default_rng(3)
    u, v = rng.uniform(-30.0, 30.0, 2000), rng.uniform(-3.0, 3.0, 2000)
    lift = 2.0 * section(v, 1.0, 1.0, Kind(1, footprint))[0] + 0.03 * rng.normal(size=2000)
    patch = Patch(u, v, lift, np.full(2000, 0.03))
    first = first_ridge(patch, spacing_mm=0.5, start=(-30.0, 30.0))
    assert first is not None
    ridge = fit_ridge(patch, first, spacing_mm=0.5)
    assert ridge.kind == Kind(1, footprint)
    assert ridge.height_mm == pytest.approx(2.0, abs=0.03)
    assert ridge.width_mm == pytest.approx(2.0, abs=0.03)


def test_a_ridge_beside_all_of_its_vertices_is_left_as_it_is() -> None:
    """An axis 15 degrees off gave such a triangle, and a traceback in place of a result."""
    rng = np.random.default_rng(2)
    u, v = rng.uniform(0.0, 20.0, 200), rng.uniform(-3.0, 3.0, 200)
    patch = Patch(u, v, np.maximum(1.0 - np.abs(v), 0.0) + rng.normal(0.0, 0.02, 200), np.full(200, 0.02))
    first = first_ridge(patch, spacing_mm=0.8, start=(0.0, 20.0))
    assert first is not None
    beside = replace(first, parameters=first.parameters + np.array([0.0, 100.0, 0.0, 0.0, 0.0]))
    assert fit_ridge(patch, beside, spacing_mm=0.8).height_mm == pytest.approx(beside.height_mm)


def _ridge_of(heights: Floats, *, kind: Kind, half: float, seed: int) -> tuple[float, float]:
    """Height and sigma of a burr 24 mm long, its crest as given over each 2 mm, vertices 0.5 mm apart."""
    rng = np.random.default_rng(seed)
    u, v = rng.uniform(-12.0, 12.0, 600), rng.uniform(-3.0, 3.0, 600)
    crest = heights[np.minimum(((u + 12.0) / 24.0 * len(heights)).astype(int), len(heights) - 1)]
    lift = crest * section(v, half, half, kind)[0] + 0.02 * rng.normal(size=600)
    patch = Patch(u, v, lift, np.full(600, 0.02))
    first = first_ridge(patch, spacing_mm=0.5, start=(-12.0, 12.0))
    assert first is not None
    return height_of(patch, fit_ridge(patch, first, spacing_mm=0.5), row_mm=0.5)


@pytest.mark.parametrize("half", [0.7, 1.0, 1.6])
@pytest.mark.parametrize("kind", [Kind(), Kind(2), Kind(1, 0.5, 0.33), Kind(1, 0.5, 0.67)])
def test_a_crest_s_height_is_told_whatever_its_section(kind: Kind, half: float) -> None:
    """A triangle alone overshoots blunt crests by a tenth to a quarter."""
    height, sigma = _ridge_of(np.full(12, 1.2), kind=kind, half=half, seed=5)
    assert height == pytest.approx(1.2, abs=max(3.0 * sigma, 0.02))
    assert sigma < 0.05


def test_a_torn_burr_is_as_high_as_its_highest_stretches_and_surely_so() -> None:
    """Differences along it make one ridge fit badly; they are not noise, and must not hide behind it."""
    heights = np.array([0.6, 0.7, 0.6, 0.8, 1.2, 1.3, 1.2, 0.8, 0.6, 0.5, 0.6, 0.5])
    found = [_ridge_of(heights, kind=Kind(), half=1.0, seed=seed) for seed in range(16)]
    height, sigma = np.mean(found, axis=0)
    assert height == pytest.approx(1.3, abs=0.04)
    assert sigma < 0.05


def _smooth(rng: np.random.Generator, reach: float) -> Floats:
    """24 values of a Gaussian process that is smoother than the one that is fitted: squared exponential."""
    place = np.arange(24.0)
    covariance = np.exp(-0.5 * ((place[:, None] - place) / reach) ** 2) + 1e-9 * np.eye(24)
    return np.asarray(np.linalg.cholesky(covariance) @ rng.normal(size=24))


@pytest.mark.parametrize("reach", [2.0, 5.0])
@pytest.mark.parametrize("noise", [0.01, 0.03, 0.06])
def test_the_highest_place_is_told_through_noise(noise: float, reach: float) -> None:
    """A burr that differs by 10 % along it: its mean is 18 % lower; the highest row is by noise too high."""
    rng = np.random.default_rng(0)
    off, sure = np.zeros((2, 200))
    for number in range(len(off)):
        true = 1.0 + 0.1 * _smooth(rng, reach)
        seen = true + noise * rng.normal(size=24)
        most, sigma = highest(0.7 * seen, np.full(24, (0.7 * noise) ** -2))
        off[number] = most * seen.mean() - true.max()
        sure[number] = np.hypot(sigma * seen.mean(), noise / np.sqrt(24.0))
    assert abs(off.mean()) < 0.02
    assert np.sqrt((off**2).mean()) < max(0.8 * noise, 0.01)
    assert 0.6 < np.sqrt(((off / sure) ** 2).mean()) < 1.5


@pytest.mark.parametrize("noise", [0.03, 0.1])
def test_a_burr_as_high_all_along_is_hardly_made_higher(noise: float) -> None:
    """The highest of 24 rows is two standard deviations too high, of a mean that errs by a fifth of one."""
    rng = np.random.default_rng(1)
    gains = [highest(seen, np.full(24, noise**-2))[0] for seen in 1.0 + noise * rng.normal(size=(400, 24))]
    assert 1.0 <= np.mean(gains) < 1.0 + 0.5 * noise
    rows = 1.0 + noise * rng.normal(size=(100, 24))  # and state half of their noise
    assert np.mean([highest(seen, np.full(24, (0.5 * noise) ** -2))[0] for seen in rows]) < 1.0 + 0.8 * noise
    assert highest(np.array([0.1, -0.3, 0.1]), np.ones(3)) == (1.0, 0.0)


@pytest.mark.parametrize(("noise", "most"), [(0.03, 0.025), (0.08, 0.05)])
def test_where_a_burr_is_torn_off_there_is_none_of_it(noise: float, most: float) -> None:
    """What stands is as high all along: gaps are no low places, nor are rows of which a part is torn off.

    Of the mean, which is the ridge's, gaps are a part.
    """
    rng, at, over = np.random.default_rng(6), np.arange(28), []
    for _ in range(200):
        start, length = rng.uniform(3.0, 18.0), rng.uniform(4.0, 7.0)
        torn = np.clip(np.minimum(at + 1.0, start + length) - np.maximum(at, start), 0.0, 1.0)
        seen = 1.0 - torn + noise * rng.normal(size=28)
        over.append(highest(seen, np.full(28, noise**-2))[0] * seen.mean() - 1.0)
    assert abs(np.mean(over)) < most
    assert np.sqrt(np.mean(np.square(over))) < 1.5 * most


def test_a_low_place_that_is_noise_is_no_gap() -> None:
    """Three rows of thirty at nothing, each known to half of the height, and those beside them count."""
    share, weight = 1.0 + 0.05 * np.random.default_rng(7).normal(size=30), np.full(30, 4.0)
    share[10:13] = 0.0
    surer = np.where(np.isin(np.arange(30), np.arange(9, 14)), 0.0, weight)
    without = highest(share, surer)[0] * np.mean(share[surer > 0.0])
    assert highest(share, weight)[0] * np.mean(share) < without


class Dense(NamedTuple):
    """A course as one Gaussian of all its rows: what they tell of its mean and of its largest value."""

    mean: float
    precision: float
    evidence: float
    most: Floats


def dense(rows: Floats, seen: Floats, variance: Floats, spread: float, reach: float, draws: int) -> Dense:
    """By matrices of all rows, and draws of all of them at once."""
    process = spread**2 * np.exp(-np.abs(rows[:, None] - rows) / reach)
    inverse = np.linalg.inv(process + np.diag(variance))
    precision = float(inverse.sum())
    mean = float((inverse @ seen).sum() / precision)
    left, taken = seen - mean, process @ inverse
    evidence = 0.5 * float(np.linalg.slogdet(inverse)[1] - np.log(precision) - left @ inverse @ left)
    by_mean = 1.0 - taken.sum(axis=1)
    after = process - taken @ process + np.outer(by_mean, by_mean) / precision
    most = np.random.default_rng(2).multivariate_normal(mean + taken @ left, after, draws).max(axis=1)
    return Dense(mean, precision, evidence, most)


@pytest.mark.parametrize(("noise", "reach"), [(0.1, 3.0), (2.0, 16.0)])
def test_courses_have_the_largest_value_that_dense_matrices_give_them(noise: float, reach: float) -> None:
    """One spread and reach, against 200,000 draws."""
    rng = np.random.default_rng(2)
    rows = np.flatnonzero(rng.uniform(size=30) < 0.8)
    variance = rng.uniform(0.1 * noise, 2.0 * noise, len(rows)) ** 2
    seen = 1.0 + 0.2 * rng.normal(size=len(rows))
    courses = _filtered(seen, variance[:, None], np.exp(-np.diff(rows)[:, None] / reach), np.array([0.25]))
    true = dense(rows.astype(float), seen, variance, 0.25, reach, 200_000)
    assert courses.mean == pytest.approx(true.mean)
    assert courses.precision == pytest.approx(true.precision)
    assert courses.evidence == pytest.approx(true.evidence)
    drawn = courses.largest()[0]
    assert drawn.mean() == pytest.approx(true.most.mean(), abs=3.0 * true.most.std() / np.sqrt(drawn.size))
    assert drawn.std() == pytest.approx(true.most.std(), rel=3.0 / np.sqrt(2.0 * drawn.size))


@pytest.mark.parametrize("noise", [0.03, 0.12])
def test_all_spreads_reaches_and_noises_count_by_their_evidence(noise: float) -> None:
    """Against 4000 draws for each of them; rows err by twice what they state."""
    rows = np.arange(14.0)
    seen = 1.0 + 0.1 * np.sin(rows) + noise * np.random.default_rng(8).normal(size=14)
    stated = np.full(14, (0.5 * noise) ** 2)
    evidence, most, spread_of_most = [], [], []
    each = [(s, r, n) for s in along._SPREADS for r in along._REACHES for n in along._NOISES]
    for spread, reach, times in [*each, *((0.0, 1.0, n) for n in along._NOISES)]:
        true = dense(rows, seen, times * stated, spread, reach, 4000)
        prior = (1.0 - along._EVEN) / len(each) if spread else along._EVEN / len(along._NOISES)
        evidence.append(np.log(prior) + true.evidence)
        most.append(true.most.mean() if spread else true.mean)
        spread_of_most.append(true.most.std() if spread else 0.0)
    odds = np.exp(np.array(evidence) - max(evidence))
    odds /= odds.sum()
    expected = odds @ most
    sigma = np.sqrt(odds @ (np.square(spread_of_most) + (np.array(most) - expected) ** 2))
    found = highest(seen, 1.0 / stated)
    assert found[0] * seen.mean() == pytest.approx(expected, abs=0.1 * sigma + 1e-3)
    assert found[1] * seen.mean() == pytest.approx(sigma, rel=0.1)


def test_vertices_that_scatter_more_than_they_state_raise_no_height() -> None:
    rng = np.random.default_rng(6)
    u, v = (each.ravel() for each in np.meshgrid(0.5 * np.arange(24), 0.5 * np.arange(-5, 6)))
    even = section(v, 1.4, 1.4, Kind())[0]
    raised = []
    for _ in range(12):
        patch = Patch(u, v, even + 0.1 * rng.normal(size=len(u)), np.full(len(u), 0.02))
        first = first_ridge(patch, spacing_mm=0.5, start=(0.0, 12.0))
        assert first is not None
        raised.append(height_of(patch, first, row_mm=0.5)[0] / first.height_mm)
    assert np.mean(raised) < 1.04


def test_rows_that_are_not_seen_and_too_few_rows_tell_no_course(monkeypatch: pytest.MonkeyPatch) -> None:
    """What lies in a row with a tenth of the usual weight is as if there were none; its place stays."""
    kept: list[Floats] = []

    def spied(height: Floats, variance: Floats, from_row: Floats, spread: Floats) -> along._Courses:
        kept.append(from_row)
        return _filtered(height, variance, from_row, spread)

    monkeypatch.setattr(along, "_filtered", spied)
    share, weight = 1.0 + 0.05 * np.random.default_rng(5).normal(size=20), np.full(20, 400.0)
    share[3:6], weight[3:6] = 1.6, 40.0
    unseen = weight.copy()
    unseen[3:6] = 0.0
    assert highest(share, weight) == highest(share, unseen)
    np.testing.assert_allclose(-np.log(kept[0][:, 0]) * along._REACHES[0], [1, 1, 4] + [1] * 13)
    assert highest(share[2:5], unseen[2:5]) == (1.0, 0.0)
    assert highest(share, np.zeros(20)) == (1.0, 0.0)


@pytest.mark.parametrize("footprint", [0.0, 0.2, 0.35, 0.5])
@pytest.mark.parametrize("half", [0.3, 0.4])
def test_a_burr_as_narrow_as_its_pixels_is_unsure_by_what_they_may_be(half: float, footprint: float) -> None:
    """Points, or means over a whole pixel: where neither is true, data are sure of one, and wrong."""
    for seed in range(6):
        rng = np.random.default_rng(seed)
        u, v = rng.uniform(-12.0, 12.0, 600), rng.uniform(-3.0, 3.0, 600)
        lift = 2.0 * section(v, half, half, Kind(1, footprint))[0] + 0.03 * rng.normal(size=600)
        patch = Patch(u, v, lift, np.full(600, 0.03))
        first = first_ridge(patch, spacing_mm=0.5, start=(-12.0, 12.0))
        assert first is not None
        ridge = fit_ridge(patch, first, spacing_mm=0.5)
        sigma = float(np.linalg.norm([ridge.sigma_of([1, 0, 0, 0, 0]), ridge.open_mm, 0.02]))
        assert abs(ridge.height_mm - 2.0) < 3.0 * sigma  # 1 % is what a description allows for shapes
        assert sigma < 0.8
