"""What all parallels of a part say of the light on one."""

import numpy as np
import pytest

from burrscan.arrays import Bools, Floats
from burrscan.burrs.light.brightness import excess
from burrscan.burrs.light.lobe import excess_of_lobe

HALF, GAP = 19, 3
ROWS, COLUMNS = 60, 240
NOISE = 0.02


def highlight(tilt: Floats) -> Floats:
    """Logarithm of the lobe (GGX, 0.06) of turned metal whose columns are 0.4 degrees apart."""
    return np.asarray(-2.0 * np.log1p((np.tan(np.radians(0.4 * tilt)) / 0.06) ** 2))


def part(*, seed: int = 1) -> tuple[Floats, Floats, Bools]:
    """Brightness, tilt and what is known: the highlight drifts from parallel to parallel, which differ."""
    rng = np.random.default_rng(seed)
    at = 110.0 + 0.13 * np.arange(ROWS)
    tilt = np.arange(COLUMNS) - at[:, None]
    light = highlight(tilt) + rng.normal(size=(ROWS, 1)) + NOISE * rng.normal(size=tilt.shape)
    known = np.ones(tilt.shape, bool)
    known[:20, :70] = False
    return light, tilt, known


def test_the_highlight_of_every_parallel_is_predicted() -> None:
    light, tilt, known = part()
    top = known & (np.abs(tilt) < 16.0)
    alone, together = (
        rest[top] for rest in (excess(light, known, half=HALF, gap=GAP)[0], with_lobe(light, tilt, known))
    )
    assert (np.abs(alone) > 6.0 * NOISE).mean() > 0.3
    assert (np.abs(together) > 6.0 * NOISE).mean() < 0.02
    assert np.sqrt((together**2).mean()) < 2.0 * NOISE


def with_lobe(light: Floats, tilt: Floats, known: Bools) -> Floats:
    return excess_of_lobe(light, known, tilt, half=HALF, gap=GAP)[0]


@pytest.mark.parametrize("rows", [slice(20, 40), slice(0, ROWS)])
@pytest.mark.parametrize("off", [-8.0, 0.0, 25.0])
def test_a_burr_however_long_is_no_part_of_the_lobe(rows: slice, off: float) -> None:
    light, tilt, known = part()
    burr = np.zeros(known.shape, bool)
    burr[rows] = np.abs(tilt[rows] - off) <= 1.0
    light[burr & known] -= 1.0
    rest = with_lobe(light, tilt, known)
    assert np.median(rest[burr & known]) == pytest.approx(-1.0, abs=0.1)
    beside = known & ~burr & (np.abs(tilt - off) < 12.0)
    assert (np.abs(rest[beside]) > 0.3).mean() < 0.02


def test_a_parallel_of_another_finish_is_predicted_by_itself() -> None:
    light, tilt, known = part()
    light[:15] = (-((tilt / 90.0) ** 2) + NOISE * np.random.default_rng(2).normal(size=tilt.shape))[:15]
    rest, predicted, scatter = excess_of_lobe(light, known, tilt, half=HALF, gap=GAP)
    plain = excess(light, known, half=HALF, gap=GAP)
    for ours, alone in zip((rest, predicted, scatter), plain, strict=True):
        np.testing.assert_array_equal(ours[:15], alone[:15])
    assert (np.abs(rest[15:][np.abs(tilt[15:]) < 16.0]) > 6.0 * NOISE).mean() < 0.02
    np.testing.assert_allclose((rest + predicted)[known], light[known])


@pytest.mark.parametrize(
    ("seen", "away"), [(slice(150, 240), 0.0), (slice(60, 105), 0.0), (slice(140, 175), 400.0)]
)
def test_what_shows_no_highlight_is_predicted_as_well_as_before(seen: slice, away: float) -> None:
    """The logarithm of a lobe far away is a polynomial, and normal equations with both are singular."""
    light, tilt, _ = part()
    known = np.zeros(light.shape, bool)
    known[:, seen] = True
    rest, plain = with_lobe(light, tilt + away, known), excess(light, known, half=HALF, gap=GAP)[0]
    there = np.isfinite(plain)
    np.testing.assert_array_equal(there, np.isfinite(rest))
    assert np.abs(rest[there]).mean() <= np.abs(plain[there]).mean()
    assert np.abs(rest[there]).max() < 10.0 * NOISE


def test_what_is_dark_is_no_highlight() -> None:
    _, tilt, known = part()
    light = NOISE * np.random.default_rng(2).normal(size=tilt.shape) - highlight(tilt)
    np.testing.assert_array_equal(with_lobe(light, tilt, known), excess(light, known, half=HALF, gap=GAP)[0])


def test_nothing_known_is_no_error() -> None:
    light, tilt, known = part()
    rest, predicted, scatter = excess_of_lobe(light, np.zeros_like(known), tilt, half=HALF, gap=GAP)
    assert np.isnan(rest).all()
    assert np.isnan(predicted).all()
    assert np.isfinite(scatter).all()
    few = np.zeros_like(known)
    few[3, 5:7] = True
    assert np.isnan(excess_of_lobe(light, few, tilt, half=HALF, gap=GAP)[0]).all()


@pytest.mark.parametrize("diffuse", [0.002, 0.03, 0.3])
def test_what_scatters_ends_a_highlight(diffuse: float) -> None:
    """On oxidised steel the lobe was a factor 1.8 off at the top, and a dark nick beside it was lost."""
    _, tilt, known = part()
    light = np.log(np.exp(highlight(tilt)) + diffuse) + NOISE * np.random.default_rng(3).normal(
        size=tilt.shape
    )
    top = known & (np.abs(tilt) < 16.0)
    off = with_lobe(light, tilt, known)[top]
    assert np.sqrt((off**2).mean()) < 1.5 * NOISE
