"""Tool paths over burrs of a drum whose surface is known."""

from __future__ import annotations

import numpy as np
import pytest

from burrscan.cell.toolpath import lift, tool_path
from burrscan.errors import InputError
from scenes.cell.errors import motion
from tests.burrscan.cell.parts import RADIUS_MM, axis, burr, generatrix


def test_the_mill_goes_along_the_burr_on_the_surface() -> None:
    path = tool_path(burr(30.0), axis=axis(), generatrix=generatrix(), radius_mm=2.0)
    tips, out = path.stations[:, :3, 3], path.stations[:, :3, 2]
    assert np.allclose(np.hypot(tips[:, 0], tips[:, 1]), RADIUS_MM, atol=1e-6)
    assert np.allclose((out * tips).sum(axis=1) / RADIUS_MM, 1.0, atol=1e-3)  # z is the radial normal
    assert tips[:, 2].min() == pytest.approx(14.0)  # half of 10 mm, and 1 mm beyond
    assert tips[:, 2].max() == pytest.approx(26.0)
    assert path.covered == 1.0
    middle = np.degrees(np.arctan2(tips[:, 1], tips[:, 0])).mean()
    assert middle == pytest.approx(30.0, abs=0.05)


def test_lanes_cover_a_wide_burr() -> None:
    wide = burr(0.0, height_mm=5.0)
    path = tool_path(wide, axis=axis(), generatrix=generatrix(), radius_mm=1.5)
    across = RADIUS_MM * np.arctan2(path.stations[:, 1, 3], path.stations[:, 0, 3])
    # every place of base and height lies under the mill in some lane
    for place in np.linspace(-3.25, 3.25, 14):
        assert np.abs(across - place).min() < 1.5


def test_passes_go_down_in_bites_and_end_twice_on_the_surface() -> None:
    path = tool_path(burr(height_mm=1.0), axis=axis(), generatrix=generatrix(), radius_mm=2.0, bite_mm=0.4)
    assert path.passes_mm[-2:] == (0.0, 0.0)
    steps = -np.diff([1.1, *path.passes_mm[:-1]])  # height and two standard deviations
    assert (steps > 0.0).all()
    assert (steps <= 0.4 + 1e-9).all()


def test_the_mill_stays_away_from_a_wall() -> None:
    beside = burr(0.0, z_mm=36.0, length_mm=8.0)  # it ends at the wall at z = 40 mm
    path = tool_path(beside, axis=axis(), generatrix=generatrix(step=True), radius_mm=2.0)
    assert path.stations[:, 2, 3].max() <= 38.0 + 0.1
    assert path.covered < 1.0


def test_the_path_moves_with_the_part() -> None:
    here = tool_path(burr(10.0), axis=axis(), generatrix=generatrix(), radius_mm=2.0)
    there = here.placed(motion(np.array([5.0, -3.0, 2.0, 0.1, 0.2, -0.3])))
    back = np.linalg.inv(motion(np.array([5.0, -3.0, 2.0, 0.1, 0.2, -0.3])))
    assert np.allclose(back @ there.stations, here.stations)


def test_travel_never_leaves_the_burr_idly() -> None:
    path = tool_path(burr(), axis=axis(), generatrix=generatrix(), radius_mm=2.0)
    poses = [pose for _, pose in path.travel()]
    steps = np.linalg.norm(np.diff([pose[:3, 3] for pose in poses], axis=0), axis=1)
    assert steps.max() < 4.0
    assert np.allclose(poses[-1], path.stations[path.last])
    assert np.allclose(path.above(0), lift(path.stations[0], path.approach_mm))


def test_what_no_mill_can_do_is_refused() -> None:
    with pytest.raises(InputError, match="nick"):
        tool_path(burr(side="nick"), axis=axis(), generatrix=generatrix(), radius_mm=2.0)
    with pytest.raises(InputError, match="smaller"):
        tool_path(
            burr(z_mm=39.0, length_mm=0.5), axis=axis(), generatrix=generatrix(step=True), radius_mm=8.0
        )
