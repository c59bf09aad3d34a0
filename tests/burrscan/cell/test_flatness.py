"""Bare metal under a call speaks against it; a burr that is there does not."""

from __future__ import annotations

import numpy as np
import pytest

from burrscan.arrays import Floats
from burrscan.cell.flatness import bare
from burrscan.inspection import Burr
from tests.burrscan.cell.parts import RADIUS_MM, burr


def _drum(*, ridge_mm: float = 0.0, noise_mm: float = 0.03, pitch_mm: float = 0.5) -> tuple[Floats, Floats]:
    """Points of a drum with a ridge at angle 0 from z = 15 to 25 mm, and their deviations."""
    rng = np.random.default_rng(2)
    angle, z = np.meshgrid(np.arange(-0.7, 0.7, pitch_mm / RADIUS_MM), np.arange(0.2, 39.8, pitch_mm))
    high = ridge_mm * np.clip(1.0 - np.abs(angle) * RADIUS_MM / 0.75, 0.0, None) * (np.abs(z - 20.0) < 5.0)
    deviation = high + noise_mm * rng.normal(size=z.shape)
    radius = RADIUS_MM + deviation
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=-1)
    return points.reshape(-1, 3), deviation.ravel()


def _pose(made: Burr) -> Floats:
    return np.array(made.T_mesh_burr)


def test_bare_metal_speaks_against_a_call_and_a_burr_does_not() -> None:
    call = burr(0.0)
    assert bare(call, _pose(call), *_drum())
    assert not bare(call, _pose(call), *_drum(ridge_mm=1.0))
    assert not bare(call, _pose(call), *_drum(ridge_mm=0.6))


def test_one_wrong_flank_is_no_bare_metal() -> None:
    call = burr(0.0)
    points, deviation = _drum(ridge_mm=1.0, pitch_mm=0.2)
    wrong = np.where(points[:, 1] < 0.0, -0.5, deviation)
    assert not bare(call, _pose(call), points, wrong)


def test_a_look_from_the_other_side_says_nothing() -> None:
    call = burr(180.0)
    assert not bare(call, _pose(call), *_drum())


def test_the_side_counts() -> None:
    nick = burr(0.0, side="nick")
    assert bare(nick, _pose(nick), *_drum())
    points, deviation = _drum(ridge_mm=1.0)
    assert not bare(nick, _pose(nick), points, -deviation)


@pytest.mark.parametrize("turn_deg", [0.0, 25.0])
def test_a_long_line_around_the_axis_is_followed_around(turn_deg: float) -> None:
    around = burr(turn_deg, length_mm=60.0)
    pose = _pose(around)
    # x around the axis: 60 mm of this drum are 43 degrees, and the chord is 5.6 mm off at its ends
    pose[:3, :3] = np.stack([-pose[:3, 1], pose[:3, 0], pose[:3, 2]], axis=1)
    points, deviation = _drum()
    assert bare(around, pose, points, deviation)
    beside = np.abs(np.arctan2(points[:, 1], points[:, 0]) - np.radians(turn_deg)) * RADIUS_MM > 12.0
    # a rim burr that is there but for its middle third
    assert not bare(around, pose, points, np.where(beside, 1.0, deviation))
