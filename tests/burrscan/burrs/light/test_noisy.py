"""Depths that are noise, and those of a surface within it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from burrscan.arrays import Bools, Floats, Ints
from burrscan.burrs.light.noisy import depths_are_noise

SHAPE = (60, 80)
STATED = np.full(SHAPE, 0.05)


def pixels(per_pixel: int = 1) -> Ints:
    """Where cells lie on an image, so many of them in a row in each pixel."""
    row, column = np.indices(SHAPE)
    return np.stack([row, column // per_pixel])


def disc() -> Bools:
    row, column = np.indices(SHAPE)
    return np.asarray(np.hypot(row - 30, column - 40) < 5.0)


def noise(seed: int) -> Floats:
    return np.asarray(0.1 * np.random.default_rng(seed).normal(size=SHAPE))  # twice what is stated


@pytest.mark.parametrize("per_pixel", [1, 3])
def test_noise_is_noise_however_many_cells_a_pixel_has(per_pixel: int) -> None:
    """By chance 1 % agree: of 200 no more than seven (z = 3)."""
    seen = []
    for seed in range(200):
        depth = np.repeat(noise(seed)[:, ::per_pixel], per_pixel, axis=1)[:, : SHAPE[1]]
        seen.append(depths_are_noise(disc(), depth, STATED, pixels(per_pixel)))
    assert sum(seen) >= 193


def test_what_neighbours_agree_on_is_a_surface() -> None:
    """As far off as the noise, and as often above as below."""
    for seed in range(50):
        smooth = ndimage.gaussian_filter(noise(seed), 1.0)
        assert not depths_are_noise(disc(), smooth * 0.1 / smooth.std(), STATED, pixels())


def test_what_is_far_beyond_what_is_stated_is_no_noise() -> None:
    assert not depths_are_noise(disc(), 5.0 * noise(1), STATED, pixels())
    assert depths_are_noise(disc(), 5.0 * noise(1), 5.0 * STATED, pixels())


@pytest.mark.parametrize("known", [0, 1, 4])
def test_of_too_few_depths_nothing_is_said(known: int) -> None:
    depth = np.full(SHAPE, np.nan)
    depth[30, 38 : 38 + known] = 0.05
    assert not depths_are_noise(disc(), depth, STATED, pixels())


@pytest.mark.filterwarnings("error")
def test_cells_on_the_surface_itself_may_state_no_error() -> None:
    """Nothing over nothing was no number, of which no median is less than anything: no noise."""
    depth, stated = noise(2), STATED.copy()
    depth[30, 40], stated[30, 40] = 0.0, 0.0
    assert depths_are_noise(disc(), noise(2), STATED, pixels())
    assert depths_are_noise(disc(), depth, stated, pixels())
