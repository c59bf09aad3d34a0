"""What cells scatter by: a row's share times a slope's, told from noise that was drawn so."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from burrscan.arrays import Floats
from burrscan.burrs.light.row_sigma import cell_sigma, row_sigma

FACING = np.cos(np.linspace(-1.3, 1.3, 400)) * np.ones((60, 1))
ROWS = np.linspace(0.8, 2.0, 60)[:, None]
LEAST = 1e-9


def drawn(*, flatter: float, seed: int = 0) -> tuple[Floats, Floats]:
    """Noise whose sigma is the row's, and grows as a power of the slope; and that sigma."""
    sigma = 0.02 * ROWS * FACING**-flatter
    return sigma * np.random.default_rng(seed).normal(size=sigma.shape), sigma


@pytest.mark.parametrize("flatter", [0.0, 0.5, 1.0])
def test_rows_and_slopes_are_told_apart(flatter: float) -> None:
    rest, sigma = drawn(flatter=flatter)
    told = cell_sigma(rest, FACING, least=LEAST)
    # at the steepest, a step of the cosine changes sigma by a third of itself
    np.testing.assert_allclose(told[FACING > 0.4], sigma[FACING > 0.4], rtol=0.2)
    assert np.abs(np.log(told / sigma)).mean() < 0.07


@pytest.mark.parametrize("known", [20, 21, 22, 23])
def test_a_row_has_the_median_of_what_is_known_of_it(known: int) -> None:
    rest = np.full((40, 22 + known % 2), np.nan)
    rest[:, :known] = np.random.default_rng(known).normal(size=(40, min(known, rest.shape[1])))
    np.random.default_rng(0).permuted(rest, axis=1, out=rest)
    expected = [1.4826 * np.nanmedian(np.abs(row)) for row in rest]
    calmest = 0.5 * 1.4826 * np.nanmedian(np.abs(rest))
    np.testing.assert_allclose(row_sigma(rest, least=0.0), np.maximum(expected, calmest), rtol=1e-4)


def test_what_is_looked_at_flatly_says_nothing_of_the_rest() -> None:
    """A row's scatter alone does: half of a scan that errs at its rim makes all of it dull."""
    rest, sigma = drawn(flatter=0.0)
    spoilt = np.where(FACING < 0.7, 6.0 * rest, rest)
    well = FACING > 0.8
    assert cell_sigma(spoilt, FACING, least=LEAST)[well] == pytest.approx(sigma[well], rel=0.3)
    assert np.median((row_sigma(spoilt, least=LEAST)[:, None] / sigma)[well]) > 1.5


def test_burrs_do_not_make_a_slope_rough() -> None:
    rest, sigma = drawn(flatter=0.5)
    rest[20:40, 195:205] = 3.0
    told = cell_sigma(rest, FACING, least=LEAST)
    assert np.abs(np.log(told / sigma))[20:40].mean() < 0.1


@pytest.mark.study
@given(scale=st.floats(1e-3, 1e3), seed=st.integers(0, 100))
def test_it_goes_with_what_it_is_told_of(scale: float, seed: int) -> None:
    rest, _ = drawn(flatter=0.5, seed=seed)
    rest[::7, ::3] = np.nan
    once = cell_sigma(rest, FACING, least=LEAST)
    np.testing.assert_allclose(cell_sigma(scale * rest, FACING, least=LEAST), scale * once, rtol=1e-9)
    turned = cell_sigma(-rest[:, ::-1], FACING[:, ::-1], least=LEAST)
    np.testing.assert_allclose(turned, once[:, ::-1], rtol=1e-9)


def test_without_noise_and_without_values_it_is_the_least() -> None:
    for rest in (np.zeros((5, 40)), np.full((5, 40), np.nan)):
        told = cell_sigma(rest, np.ones((5, 40)), least=1e-3)
        assert (told >= 1e-3).all()
        assert (told < 2e-3).all()
