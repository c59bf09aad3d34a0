"""Lines of another brightness on a flat surface, through pixels that see the mean column of their light."""

from __future__ import annotations

import numpy as np
import pytest

from burrscan.arrays import Bools, Floats
from burrscan.burrs.light.flat import wanders_flat

ROWS, COLUMNS, FINE = 24, 40, 64
NOISE_MM = 0.01
DEPTH_MM = 0.45
"""By which a depth is off whose column is that of the neighbouring pixel."""


def line(
    *, width: float, factor: float, askew: float, start: float, rng: np.random.Generator
) -> tuple[Bools, Floats]:
    """Cells that such a line disturbs, and depths there: each pixel's centroid of the light it receives.

    ``width`` and ``start`` in pixels; ``askew`` is what the line moves by from row to row.
    """
    x = (np.arange(COLUMNS * FINE) + 0.5) / FINE
    middle = start + askew * np.arange(ROWS)[:, None]
    light = np.where(np.abs(x - middle) < 0.5 * width, factor, 1.0).reshape(ROWS, COLUMNS, FINE)
    inside = (np.arange(FINE) + 0.5) / FINE - 0.5
    centroid = (light * inside).sum(axis=-1) / light.sum(axis=-1)
    depth = DEPTH_MM * centroid + NOISE_MM * rng.normal(size=centroid.shape)
    return np.abs(centroid) > 0.05, depth


@pytest.mark.parametrize("slant", [(0.05, 0.1), (0.1, 0.6)])
@pytest.mark.parametrize("factor", [0.1, 0.4, 4.0, 10.0])
@pytest.mark.parametrize("width", [0.3, 0.8, 1.6])
def test_a_scratch_that_runs_askew_is_flat(width: float, factor: float, slant: tuple[float, float]) -> None:
    """Its rows' sums agree to two standard errors by chance in 5 %, in two or three stretches in more."""
    rng = np.random.default_rng([int(10 * width), int(10 * factor), int(10 * slant[1])])
    flat = []
    for _ in range(100):
        askew = float(rng.uniform(*slant) * rng.choice([-1.0, 1.0]))
        cells, depth = line(width=width, factor=factor, askew=askew, start=20.0 + rng.random(), rng=rng)
        flat.append(wanders_flat(cells, depth))
    assert np.mean(flat) >= 0.85


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_what_stands_up_or_is_cut_in_along_it_is_not(side: float) -> None:
    """A burr of a fifth of a millimetre, two pixels wide, whose flanks are as bright as scratches."""
    rng = np.random.default_rng(3)
    for _ in range(100):
        askew, start = float(rng.uniform(0.1, 0.6)), 20.0 + rng.random()
        cells, depth = line(width=2.0, factor=4.0, askew=askew, start=start, rng=rng)
        pixel = np.arange(COLUMNS) + 0.5
        lifted = np.abs(pixel - (start + askew * np.arange(ROWS)[:, None])) < 1.0
        depth = depth + side * 0.2 * lifted
        assert not wanders_flat(cells | lifted, depth)


def test_along_the_pixels_nothing_is_told() -> None:
    """There a scratch's depths are off by the same all along, as a narrow burr's are."""
    rng = np.random.default_rng(5)
    for start in np.linspace(20.0, 21.0, 21):
        cells, depth = line(width=0.4, factor=6.0, askew=0.0, start=float(start), rng=rng)
        if cells.any():
            assert not wanders_flat(cells, depth)


def test_pixels_without_a_depth_have_no_say() -> None:
    rng = np.random.default_rng(7)
    cells, depth = line(width=0.5, factor=5.0, askew=0.3, start=20.2, rng=rng)
    depth[rng.random(depth.shape) < 0.2] = np.nan
    assert wanders_flat(cells, depth)
