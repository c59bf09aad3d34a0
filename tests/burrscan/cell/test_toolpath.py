"""Tool paths over burrs of a drum whose surface is known."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from burrscan.cell.toolpath import ToolPath, lift, tool_path
from burrscan.errors import InputError
from burrscan.inspection import Generatrix, Value
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


@pytest.mark.parametrize("height_mm", [0.02, 1.0])
def test_the_last_passes_are_half_as_high_as_the_deepest_pose_is_deep(height_mm: float) -> None:
    """Every place is cut by several poses, and is as deep as the deepest: 0.04 mm for an arm of 0.03."""
    sigma = 0.03
    path = tool_path(
        burr(height_mm=height_mm), axis=axis(), generatrix=generatrix(), radius_mm=2.0, scatter_mm=sigma
    )
    assert path.passes_mm[-2] == path.passes_mm[-1]
    assert all(before >= after for before, after in pairwise(path.passes_mm))
    # places under the mill, and the poses of the last two passes that cover each
    tips = np.concatenate([path.stations[:, :3, 3]] * 2)
    rng = np.random.default_rng(3)
    places = burr().T_mesh_burr[:3, 3] + np.column_stack(
        [np.zeros(300), rng.uniform(-0.8, 0.8, 300), rng.uniform(-4.0, 4.0, 300)]
    )
    covers = np.linalg.norm(places[:, None, 1:] - tips[None, :, 1:], axis=2) < 2.0
    assert (covers.sum(axis=1) >= 4).all()
    scatter = sigma * rng.normal(size=(400, 1, len(tips)))
    deepest = np.where(covers, scatter, np.inf).min(axis=2)
    assert path.passes_mm[-1] == pytest.approx(-0.5 * deepest.mean(), abs=0.1 * sigma)


def test_the_mill_stays_away_from_a_wall() -> None:
    beside = burr(0.0, z_mm=36.0, length_mm=8.0)  # it ends at the wall at z = 40 mm
    path = tool_path(beside, axis=axis(), generatrix=generatrix(step=True), radius_mm=2.0)
    assert path.stations[:, 2, 3].max() <= 38.0 + 0.1
    assert path.covered < 1.0


def over_a_bump(bump_mm: float) -> ToolPath:
    """The path over a burr that ends beside the edge at z = 40 mm, over which the curve stands."""
    drum = generatrix()
    over = np.where(np.abs(drum.z_mm - 39.5) < 0.1, bump_mm, 0.0)
    bumped = replace(drum, r_mm=drum.r_mm + over)
    return tool_path(burr(0.0, z_mm=34.0, length_mm=10.0), axis=axis(), generatrix=bumped, radius_mm=2.0)


def test_the_mill_rides_over_what_the_curve_is_off_by() -> None:
    path = over_a_bump(0.06)
    z, r = path.stations[:, 2, 3], np.hypot(*path.stations[:, :2, 3].T)
    assert path.covered == 1.0
    assert z.max() > 39.0
    np.testing.assert_allclose(r[z < 37.0], RADIUS_MM, atol=1e-6)
    assert 0.01 < r.max() - RADIUS_MM < 0.05


def test_the_mill_does_not_ride_over_a_wall() -> None:
    path = over_a_bump(0.3)
    assert path.covered < 1.0
    assert path.stations[:, 2, 3].max() <= 37.6
    assert np.hypot(*path.stations[:, :2, 3].T).max() < RADIUS_MM + 1e-6


def test_a_burr_beside_a_sharp_edge_is_milled_to_its_end() -> None:
    """The curve of a polished hub as it was fitted around the edge at z = 40 mm, and its stated errors.

    A lifted rim is nearest to another place of it, so one lift does not clear the mill everywhere.
    """
    z = np.array([0.0, 10.0, 20.0, 30.0, 36.0, 37.0, 38.0, 38.35, 39.3, 39.79, 40.24])
    off = np.array([*[0.0] * 8, -0.006, 0.075, -0.151])
    sigma = np.array([*[0.005] * 8, 0.009, 0.009, 0.011])
    hub = Generatrix(z, RADIUS_MM + off, sigma, np.zeros(len(z)))
    for place in np.arange(32.5, 33.5, 0.1):
        there = burr(0.0, z_mm=float(place), length_mm=10.0)
        path = tool_path(there, axis=axis(), generatrix=hub, radius_mm=2.0)
        assert path.covered == 1.0
        assert np.hypot(*path.stations[:, :2, 3].T).max() < RADIUS_MM + 0.05


def _edge() -> Generatrix:
    """The same hub as it was fitted in another look."""
    z = np.append(np.arange(21.0, 38.5, 0.85), [39.045, 39.917])
    off, sigma = np.zeros(len(z)), np.full(len(z), 0.006)
    off[-4:] = 0.007, -0.017, 0.074, -0.289
    sigma[-3:] = 0.010, 0.011, 0.013
    return Generatrix(z, RADIUS_MM + off, sigma, np.zeros(len(z)))


def test_the_mill_goes_straight_on_over_a_sharp_edge() -> None:
    """A burr told 1.9 mm longer than it is; leaning with the curve by 7 degrees the mill cut 0.28 mm off."""
    for place in np.arange(32.0, 33.3, 0.1):
        there = burr(0.0, z_mm=float(place), length_mm=12.9, height_mm=0.38)
        path = tool_path(there, axis=axis(), generatrix=_edge(), radius_mm=2.0)
        assert path.covered > 0.9
        assert np.hypot(*path.stations[:, :2, 3].T).min() > RADIUS_MM - 0.01
        assert np.degrees(np.abs(path.stations[:, 2, 2])).max() < 1.0


def test_a_lane_along_a_sharp_edge_is_as_flat_as_the_one_beside_it() -> None:
    there = burr(0.0, z_mm=37.5, length_mm=20.0)
    around = np.array(there.T_mesh_burr)
    around[:3, :2] = np.stack([around[:3, 1], -around[:3, 0]], axis=1)
    wide = replace(there, T_mesh_burr=around, width_mm=Value(4.0, 0.1))
    path = tool_path(wide, axis=axis(), generatrix=_edge(), radius_mm=2.0)
    assert len(set(path.lane.tolist())) > 1
    assert path.stations[:, 2, 3].max() > 38.5  # half a millimetre before the edge, where the curve leans
    assert np.hypot(*path.stations[:, :2, 3].T).min() > RADIUS_MM - 0.01
    assert np.degrees(np.abs(path.stations[:, 2, 2])).max() < 1.0


def test_a_part_that_bulges_is_milled_all_along() -> None:
    """A flat mill of 2 mm stands 0.05 mm deep in a bead of 9 mm at its middle, wherever it stands."""
    turn = np.linspace(-0.9, 0.9, 181)
    z, r = 20.0 + 9.0 * np.sin(turn), RADIUS_MM - 9.0 + 9.0 * np.cos(turn)
    bead = Generatrix(z, r, np.zeros(len(z)), np.zeros(len(z)))
    there = burr(0.0, z_mm=20.0, length_mm=5.0)
    path = tool_path(there, axis=axis(), generatrix=bead, radius_mm=2.0)
    assert path.covered == 1.0
    # over its middle it is as high as the burr's foot, and leans with the bead beside it
    tips = path.stations[:, :3, 3]
    off = np.hypot(np.hypot(tips[:, 0], tips[:, 1]) - (RADIUS_MM - 9.0), tips[:, 2] - 20.0) - 9.0
    assert np.abs(off).max() < 0.05


def test_the_mill_rides_over_no_wall_that_it_hardly_touches() -> None:
    """A station 1.96 mm beside a wall would cut it by 0.04 mm, however high it is lifted."""
    beside = burr(0.0, z_mm=34.04, length_mm=8.0)
    path = tool_path(beside, axis=axis(), generatrix=generatrix(step=True), radius_mm=2.0)
    assert path.stations[:, 2, 3].max() <= 38.0 + 0.03


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


def test_from_lane_to_lane_the_mill_goes_round_the_part() -> None:
    path = tool_path(burr(0.0, height_mm=5.0), axis=axis(), generatrix=generatrix(), radius_mm=1.5)
    assert path.lane.max() > 1
    tips = path.stations[:, :3, 3]
    steps = np.linalg.norm(np.diff(tips, axis=0), axis=1)
    assert steps.max() < 1.01  # straight from lane to lane would be 2.25 mm
    # what is swept between two poses reaches from rim to rim: never deep in the part
    for here, there in zip(path.stations[:-1], path.stations[1:], strict=True):
        rims = [pose[:3, 3] + side * 1.5 * pose[:3, 1] for pose in (here, there) for side in (-1.0, 1.0)]
        middles = [0.5 * (a + b) for a, b in ((rims[0], rims[3]), (rims[1], rims[2]))]
        assert min(np.hypot(x, y) for x, y, _ in middles) > RADIUS_MM - 0.006


def test_the_mill_goes_through_no_wall_between_two_stretches() -> None:
    collar = generatrix()
    inside = np.abs(collar.z_mm - 22.0) < 0.6
    walled = replace(collar, r_mm=np.where(inside, RADIUS_MM + 5.0, collar.r_mm))
    path = tool_path(burr(0.0, length_mm=20.0), axis=axis(), generatrix=walled, radius_mm=2.0)
    z = path.stations[:, 2, 3]
    assert z.max() < 20.0  # the longer stretch, below the collar
    assert z.min() == pytest.approx(9.0, abs=0.01)
    assert path.covered == pytest.approx(0.45, abs=0.06)


def test_the_path_keeps_the_distance_from_the_surface_that_the_burr_has() -> None:
    lifted = burr(30.0)
    lifted = replace(lifted, T_mesh_burr=lift(lifted.T_mesh_burr, -0.08))
    path = tool_path(lifted, axis=axis(), generatrix=generatrix(), radius_mm=2.0)
    assert np.allclose(np.hypot(*path.stations[:, :2, 3].T), RADIUS_MM - 0.08, atol=1e-6)


def test_a_curve_of_few_nodes_is_as_good_as_one_of_many() -> None:
    many = generatrix()
    nothing, kept = np.zeros(4), [0, 78, 79, 80]
    few = Generatrix(many.z_mm[kept], many.r_mm[kept], nothing, nothing)
    here = tool_path(burr(30.0), axis=axis(), generatrix=many, radius_mm=2.0)
    there = tool_path(burr(30.0), axis=axis(), generatrix=few, radius_mm=2.0)
    assert np.allclose(here.stations, there.stations, atol=1e-6)


def test_the_mill_stands_upright_on_a_curve_with_noise() -> None:
    rng = np.random.default_rng(0)
    drum = generatrix()
    lean_deg = []
    for _ in range(20):
        noise = 0.007 * rng.normal(size=drum.r_mm.shape)
        noisy = replace(drum, r_mm=drum.r_mm + noise, sigma_mm=np.full(drum.r_mm.shape, 0.007))
        path = tool_path(burr(0.0), axis=axis(), generatrix=noisy, radius_mm=2.0)
        assert path.covered == 1.0
        tips, out = path.stations[:, :3, 3], path.stations[:, :3, 2]
        assert np.abs(np.hypot(tips[:, 0], tips[:, 1]) - RADIUS_MM).max() < 0.015
        radial = tips * [1.0, 1.0, 0.0] / np.hypot(tips[:, 0], tips[:, 1])[:, None]
        lean_deg.append(np.degrees(np.arccos(np.clip((out * radial).sum(axis=1), -1.0, 1.0))))
    # the best line through eight nodes half a millimetre apart leans by 0.10 degrees, one segment by 1.1
    assert np.sqrt(np.mean(np.square(lean_deg))) < 0.125


@pytest.mark.parametrize("axial", [True, False])
def test_on_an_edge_the_mill_lies_on_the_face_of_the_burrs_pose(*, axial: bool) -> None:
    """Flat on the end face or on the round side, whatever the curve does at its corner (0.07 mm over it)."""
    side = np.stack([np.linspace(0.0, 39.5, 80), np.full(80, RADIUS_MM)], axis=1)
    face = np.stack([np.full(40, 40.0), np.linspace(RADIUS_MM - 0.5, 60.0, 40)], axis=1)
    z, r = np.concatenate([side, [[40.05, RADIUS_MM + 0.05]], face]).T
    line = Generatrix(z, r, np.full(len(z), 0.005), np.zeros(len(z)))
    pose = np.eye(4)
    up = [0.0, 0.0, 1.0] if axial else [1.0, 0.0, 0.0]
    pose[:3, :3] = np.stack([[0.0, 1.0, 0.0], np.cross(up, [0.0, 1.0, 0.0]), up], axis=1)
    pose[:3, 3] = RADIUS_MM, 0.0, 40.0
    there = replace(burr(0.0, length_mm=30.0), T_mesh_burr=pose)
    path = tool_path(there, axis=axis(), generatrix=line, radius_mm=2.0)
    tips, out = path.stations[:, :3, 3], path.stations[:, :3, 2]
    radius = np.hypot(tips[:, 0], tips[:, 1])
    assert path.covered == 1.0
    if axial:
        assert tips[:, 2] == pytest.approx(np.full(len(tips), 40.0), abs=1e-9)
        assert out == pytest.approx(np.tile([0.0, 0.0, 1.0], (len(out), 1)))
    else:
        assert radius == pytest.approx(np.full(len(tips), RADIUS_MM), abs=1e-9)
        assert (out * tips)[:, :2].sum(axis=1) == pytest.approx(radius)
    assert np.ptp(np.arctan2(tips[:, 1], tips[:, 0])) * RADIUS_MM == pytest.approx(32.0, abs=0.1)
