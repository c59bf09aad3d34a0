"""What a turn of the table does for a burr."""

from __future__ import annotations

import numpy as np
import pytest

from burrscan.arrays import Floats
from burrscan.axis.basis import perpendicular_basis
from burrscan.cell.positioner import PositionerSheet
from burrscan.cell.station import turned
from burrscan.cell.turning import turn_across

_SHEET = PositionerSheet(reach_mm=0.0, repeatability_mm=0.005, repeatability_deg=0.003, accuracy_mm=0.02)


def _plate(seed: int) -> Floats:
    rng = np.random.default_rng(seed)
    up = rng.normal(size=3)
    up /= np.linalg.norm(up)
    basis = perpendicular_basis(up)
    plate = np.eye(4)
    plate[:3, :3] = np.column_stack([basis, up])
    if np.linalg.det(plate[:3, :3]) < 0.0:
        plate[:3, 0] *= -1.0
    plate[:3, 3] = 100.0 * rng.normal(size=3)
    return plate


def _burr(radius_mm: float, *, slant_deg: float = 0.0) -> Floats:
    """Over the plate, at angle 0: x up, leaning along the drum by the slant; z outwards."""
    slant = np.radians(slant_deg)
    out = np.array([1.0, 0.0, 0.0])
    along = np.array([0.0, np.sin(slant), np.cos(slant)])
    pose = np.eye(4)
    pose[:3, :3] = np.stack([along, np.cross(out, along), out], axis=1)
    pose[:3, 3] = radius_mm, 0.0, 30.0
    return pose


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(("across", "slant"), [(0.2, 0.0), (-0.35, 20.0), (0.01, -50.0)])
def test_it_moves_the_burr_by_so_much_across_its_line(*, seed: int, across: float, slant: float) -> None:
    plate = _plate(seed)
    before = plate @ _burr(60.0, slant_deg=slant)
    turn = turn_across(plate, before, across, sheet=_SHEET)
    assert turn is not None
    after = turned(plate, turn.deg) @ np.linalg.inv(plate) @ before
    way = (np.linalg.inv(before) @ after)[:3, 3]
    assert way[1] == pytest.approx(across, rel=0.01)
    assert abs(way[2]) < 0.005  # it hardly comes nearer
    assert 0.01 < turn.sigma_mm < 0.25  # the accuracy of 0.02 mm, and 0.2 degrees at 60 mm


def test_a_burr_around_the_part_or_on_the_axis_cannot_be_moved_across() -> None:
    plate = np.eye(4)
    assert turn_across(plate, _burr(60.0, slant_deg=90.0), 0.1, sheet=_SHEET) is None
    assert turn_across(plate, _burr(60.0, slant_deg=70.0), 0.1, sheet=_SHEET) is None
    assert turn_across(plate, _burr(0.3), 0.1, sheet=_SHEET) is None
