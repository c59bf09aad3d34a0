"""What a scan errs by over more than a burr's width is taken off, burrs are not."""

from __future__ import annotations

import numpy as np
import pytest

from bench.synthetic.clean_command import clean_view
from bench.synthetic.revolution import RidgeBurr, revolution_scan
from burrscan.arrays import Floats, Ints32
from burrscan.burrs.noise.waves import without_waves
from tests.burrscan.burrs.test_burrs import found
from tests.tiers import some_of

SHAPE, STEP_MM = (120, 300), 0.6


def scattered(seed: int) -> tuple[Ints32, np.random.Generator]:
    """Two vertices a cell."""
    rng = np.random.default_rng(seed)
    places = rng.uniform((0, 0), SHAPE, (2 * SHAPE[0] * SHAPE[1], 2))
    return places.astype(np.int32), rng


def rms(values: Floats) -> float:
    return float(np.sqrt((values**2).mean()))


@pytest.mark.parametrize("width_mm", [1.0, 3.0])
def test_a_burr_stays_and_waves_go(width_mm: float) -> None:
    cell, rng = scattered(0)
    row, column = cell.T * STEP_MM
    wave = 0.1 * np.cos(2.0 * np.pi * column / 45.0) * np.cos(2.0 * np.pi * row / 60.0)
    ridge = np.where(np.abs(column - 60.0) < width_mm / 2.0, 1.0, 0.0)
    rim = np.where((np.abs(row - 36.0) < width_mm / 2.0) & (column > 90.0), -1.0, 0.0)
    apart = without_waves(
        wave + ridge + rim + rng.normal(0.0, 0.01, len(row)), cell, SHAPE, step_mm=STEP_MM, closed=False
    )
    assert apart is not None
    left, spread = apart
    for burr in (ridge, rim):
        assert np.median(left[burr != 0.0]) == pytest.approx(burr.min() + burr.max(), abs=0.06)
    plain = (ridge == 0.0) & (rim == 0.0)
    assert rms(left[plain]) < 0.016
    assert 0.02 < np.median(spread) < 0.1  # over 15 mm a wave of 45 and 60 mm goes from middle to crest
    assert np.quantile(np.abs(left[plain] / spread[plain]), 0.95) < 1.0


def test_noise_of_each_vertex_holds_no_waves() -> None:
    cell, rng = scattered(1)
    assert without_waves(rng.normal(size=len(cell)), cell, SHAPE, step_mm=STEP_MM, closed=False) is None


def test_the_seam_of_a_whole_wheel_is_like_any_place() -> None:
    cell, rng = scattered(2)
    angle = 2.0 * np.pi * (cell[:, 1] + 0.5) / SHAPE[1]
    apart = without_waves(
        np.sin(4.0 * angle) + rng.normal(0.0, 0.01, len(cell)), cell, SHAPE, step_mm=STEP_MM, closed=True
    )
    assert apart is not None
    left, _ = apart
    seam = (cell[:, 1] < 8) | (cell[:, 1] >= SHAPE[1] - 8)
    same_phase = np.abs(cell[:, 1] - SHAPE[1] // 2) < 8  # half a turn on, sin(4 angle) rises as at the seam
    assert rms(left[seam]) < 1.2 * rms(left[same_phase])


def test_burrs_are_found_among_waves_and_waves_are_none() -> None:
    """As a mean over vertices that err alike varies as one of them does, none to four of eight were found."""
    burrs = tuple(
        RidgeBurr(angle_deg=angle, height_mm=1.5, width_deg=0.6, z_start_mm=-15.0, z_end_mm=15.0)
        for angle in (-50.0, -20.0, 10.0, 40.0)
    )
    for seed, (count, some) in enumerate(((4, burrs), (4, burrs), (0, ()))):
        scan = revolution_scan(
            "cylinder", sigma_mm=0.08, correlated_over=13, seed=seed, shape=(242, 64), burrs=some
        )
        assert count - 1 <= len(found(scan)) <= count


@some_of(
    ("part", "number"),
    [("wheels", 830018), ("vases", 860026), ("plates", 830027), ("wheels", 910018)],
    first=2,
)
def test_what_is_left_of_waves_is_no_burr(part: str, number: int) -> None:
    """Views of clean parts, noise alike over ten pixels: called without doubt of waves, wide ones or rows."""
    assert clean_view(part, number, noise=0.001, reach_px=10.0).burrs == ()
