"""ISO 9283's figures as standard deviations, against draws."""

from __future__ import annotations

import numpy as np
import pytest

from burrscan.cell.positioner import REPEATABILITY_SIGMAS, PositionerSheet, seconds
from scenes.cell.errors import motion


def test_repeatability_is_mean_distance_plus_three_deviations() -> None:
    # the standard's own recipe, on draws: RP = mean(l) + 3 S(l), l the distances from the middle
    draws = np.random.default_rng(0).normal(size=(400_000, 3))
    distance = np.linalg.norm(draws - draws.mean(axis=0), axis=1)
    stated = distance.mean() + 3.0 * distance.std(ddof=1)
    assert stated == pytest.approx(REPEATABILITY_SIGMAS, rel=3e-3)
    sheet = PositionerSheet(reach_mm=1000.0, repeatability_mm=0.05, repeatability_deg=0.01)
    assert sheet.scatter_mm * REPEATABILITY_SIGMAS == pytest.approx(0.05)
    assert sheet.scatter_deg == pytest.approx(0.01 / 3.0)


def test_a_move_takes_as_long_as_its_slower_part() -> None:
    sheet = PositionerSheet(reach_mm=1000.0, speed_mm_s=100.0, speed_deg_s=10.0)
    far = motion(np.array([300.0, 400.0, 0.0, 0.0, 0.0, np.radians(20.0)]))
    turned = motion(np.array([3.0, 4.0, 0.0, 0.0, 0.0, np.radians(20.0)]))
    assert seconds(sheet, np.eye(4), far) == pytest.approx(5.0)
    assert seconds(sheet, np.eye(4), turned) == pytest.approx(2.0)
