"""What lies behind a piece of the curve was measured through it, so it is none."""

from __future__ import annotations

import numpy as np
import pytest

from burrscan.arrays import Bools, Floats
from burrscan.cell.chart import AROUND, Chart, chart_of
from burrscan.cell.ghosts import passed_through, without
from burrscan.cell.outlook import outlook
from burrscan.generatrix.polyline import polyline_of
from burrscan.inspection import Generatrix
from tests.burrscan.cell.parts import RADIUS_MM, facing, generatrix, rig

_OVER_MM = 8.0
"""Of the ghost over the drum."""


def _with_ghost(*, over_mm: float = _OVER_MM) -> Generatrix:
    """A drum, and over its middle a ring that is not there."""
    drum = generatrix()
    z = np.linspace(12.0, 28.0, 33)
    gap, nothing = np.array([np.nan]), np.zeros(len(drum.z_mm) + len(z) + 1)
    at_r = np.concatenate([drum.r_mm, gap, np.full_like(z, RADIUS_MM + over_mm)])
    return Generatrix(np.concatenate([drum.z_mm, gap, z]), at_r, nothing, nothing)


def _looks(chart: Chart, *, ghost: int) -> tuple[Bools, Floats, list[Floats]]:
    """Cells of the ghost, eyes, and densities: the drum in sight, and ``ghost`` cells of each of its rows."""
    is_ghost = chart.zr_mm[:, 1] > RADIUS_MM + 1.0
    eyes, densities = [], []
    for turn_deg in (0.0, 120.0, 240.0):
        pose = facing(turn_deg)
        drum = chart_of(generatrix())
        density = np.zeros(chart.shape)
        density[~is_ghost] = outlook(drum, rig(), pose, drum.angles).seen
        first = round(turn_deg * AROUND / 360.0)
        here = np.arange(first, first + ghost) % AROUND
        density[np.ix_(is_ghost, here)] = 1.0
        density[np.ix_(~is_ghost, here)] = 0.0  # a pixel shows one of the two
        eyes.append(np.linalg.inv(pose)[:3, 3])
        densities.append(density)
    return is_ghost, np.stack(eyes), densities


@pytest.mark.parametrize("ghost", [1, 6])
def test_a_ring_that_the_drum_is_seen_through_is_none(ghost: int) -> None:
    chart = chart_of(_with_ghost())
    is_ghost, eyes, densities = _looks(chart, ghost=ghost)
    assert is_ghost.sum() >= 4
    found = passed_through(chart, eyes, densities)
    assert found.any()
    assert not found[~is_ghost].any()
    # its ends are passed first by rays that leave the drum beside them: what is left of it is short
    kept = chart_of(without(_with_ghost(), chart, found))
    drum = kept.zr_mm[:, 1] < RADIUS_MM + 1.0
    assert np.allclose(kept.zr_mm[drum], chart.zr_mm[~is_ghost])
    assert np.count_nonzero(~drum) <= 1


def test_a_ring_that_hides_the_drum_stays() -> None:
    chart = chart_of(_with_ghost())
    _, eyes, densities = _looks(chart, ghost=30)
    is_ring = chart.zr_mm[:, 1] > RADIUS_MM + 1.0
    for density in densities:
        under = np.abs(chart.zr_mm[:, 0] - 20.0) < 8.0
        density[under & ~is_ring] = 0.0
    assert not passed_through(chart, eyes, densities).any()


def test_a_part_without_ghosts_has_none() -> None:
    chart = chart_of(generatrix(step=True))
    eyes, densities = [], []
    for turn_deg in (0.0, 90.0):
        pose = facing(turn_deg, z_mm=40.0)
        eyes.append(np.linalg.inv(pose)[:3, 3])
        densities.append(outlook(chart, rig(), pose, chart.angles).seen.astype(float))
    assert not passed_through(chart, np.stack(eyes), densities).any()


def test_what_is_left_out_leaves_a_gap_and_the_rest_as_it_was() -> None:
    curve = generatrix()
    chart = chart_of(curve)
    cells = np.abs(chart.zr_mm[:, 0] - 20.0) < 4.0
    rest = without(curve, chart, cells)
    gone = np.isnan(rest.z_mm)
    assert np.array_equal(gone, np.isnan(rest.r_mm))
    assert curve.z_mm[gone].min() > 13.0
    assert curve.z_mm[gone].max() < 27.0
    assert np.array_equal(rest.z_mm[~gone], curve.z_mm[~gone])
    assert len(polyline_of(rest).pieces) == 2
