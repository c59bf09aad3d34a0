"""What a parallel predicts of its own brightness."""

import numpy as np
import pytest

from burrscan.burrs.light.brightness import excess

HALF, GAP = 20, 4


def lobe(columns: int = 160) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """(rows, columns) parabolas of several widths and heights: finishes from a mirror's to a matte one's."""
    x = np.arange(columns)
    return np.array([a - b * (x - c) ** 2 for a in (0.0, 9.0) for b in (0.0, 1e-4, 2e-2) for c in (-40, 75)])


def test_any_lobe_is_predicted_exactly() -> None:
    light = lobe()
    rest, predicted, scatter = excess(light, np.ones(light.shape, bool), half=HALF, gap=GAP)
    assert np.isfinite(rest).all()
    assert np.abs(rest).max() < 1e-8
    np.testing.assert_allclose(predicted, light, atol=1e-8)
    assert (scatter < 1e-5).all()


@pytest.mark.parametrize("height", [-2.0, 0.3, 3.0])
def test_a_bump_within_the_gap_does_not_pull_its_own_prediction(height: float) -> None:
    light = lobe()
    truth = light.copy()
    bump = slice(80 - GAP // 2, 80 + GAP // 2 + 1)
    light[:, bump] += height
    rest, predicted, _ = excess(light, np.ones(light.shape, bool), half=HALF, gap=GAP)
    np.testing.assert_allclose(predicted[:, bump], truth[:, bump], atol=1e-8)
    np.testing.assert_allclose(rest[:, bump], height, atol=1e-8)


@pytest.mark.parametrize("height", [-2.0, 0.5, 3.0])
def test_a_bump_hardly_pulls_what_is_beside_it(height: float) -> None:
    noise = 0.02
    light = np.repeat(lobe(400)[2:3], 40, axis=0)
    light += noise * np.random.default_rng(2).normal(size=light.shape)
    bumped = light.copy()
    bumped[:, 198:203] += height
    known = np.ones(light.shape, bool)
    plain, found = (excess(each, known, half=HALF, gap=GAP)[0] for each in (light, bumped))
    beside = np.r_[180:190, 211:221]
    # least squares would move them by a tenth of the bump
    assert np.sqrt(((found - plain)[:, beside] ** 2).mean()) < noise
    assert (np.abs(found[:, beside]) > 6.0 * noise).mean() < 0.02


def test_what_is_not_known_has_no_say_and_no_excess() -> None:
    light = lobe()
    known = np.ones(light.shape, bool)
    known[:, 60:66] = False
    spoilt = np.where(known, light, 1e6)
    rest, predicted, _ = excess(spoilt, known, half=HALF, gap=GAP)
    assert np.isnan(rest[~known]).all()
    assert np.abs(rest[known]).max() < 1e-8
    np.testing.assert_allclose(predicted[~known], light[~known], atol=1e-8)


def test_a_row_that_is_too_short_has_no_prediction() -> None:
    light = lobe()
    known = np.zeros(light.shape, bool)
    known[::2, 50:59] = True  # fewer than 0.3 of the window of 32 on any side
    known[1::2] = True
    rest, predicted, scatter = excess(light, known, half=HALF, gap=GAP)
    assert np.isnan(rest[::2]).all()
    assert np.isnan(predicted[::2]).all()
    assert np.abs(rest[1::2]).max() < 1e-8
    assert np.isfinite(scatter).all()


def test_nothing_known_is_no_error() -> None:
    light = lobe()
    rest, predicted, scatter = excess(light, np.zeros(light.shape, bool), half=HALF, gap=GAP)
    assert np.isnan(rest).all()
    assert np.isnan(predicted).all()
    assert np.isfinite(scatter).all()


def test_the_scatter_of_a_row_is_its_noise() -> None:
    noise = np.random.default_rng(0).normal(size=(40, 400)) * np.linspace(0.05, 0.08, 40)[:, None]
    light = np.repeat(lobe(400)[2:3], 40, axis=0) + noise
    _, _, scatter = excess(light, np.ones(light.shape, bool), half=HALF, gap=GAP)
    # the prediction's own noise adds a tenth; a median of 400 is known to 6 %
    share = scatter / np.linspace(0.05, 0.08, 40)
    assert 1.0 < np.median(share) < 1.2
    assert 0.75 < share.min() <= share.max() < 1.45


def test_a_factor_and_a_mirror_image_change_nothing() -> None:
    light = lobe() + np.random.default_rng(1).normal(0.0, 0.02, lobe().shape)
    known = np.ones(light.shape, bool)
    rest, _, _ = excess(light, known, half=HALF, gap=GAP)
    np.testing.assert_allclose(excess(light + 5.0, known, half=HALF, gap=GAP)[0], rest, atol=1e-7)
    np.testing.assert_allclose(excess(light[:, ::-1], known, half=HALF, gap=GAP)[0][:, ::-1], rest, atol=1e-7)
