"""The simulated cell: errors as the data sheet states them, refusals, and what a mill leaves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from bench.reproduction.servoing import stated_burr
from burrscan.arrays import Floats, Ints32
from burrscan.cell.choices import arm_poses
from burrscan.cell.feed import along_its_edge, mill
from burrscan.cell.positioner import OutOfReachError, PositionerSheet
from burrscan.cell.removal import path_of
from burrscan.cell.servo import servo
from burrscan.cell.station import Stand, go, turned
from burrscan.inspection import Value
from scenes.cell.errors import AttainedPoses, motion
from scenes.cell.milling import milled
from scenes.cell.spec import CellSpec, MillSpec
from scenes.cell.truth import Left, left_of, tool_over
from scenes.cell.workcell import SimulatedCell
from scenes.pose import pose_of
from scenes.scene import scene_from
from scenes.wheel import AxialRidge, Cut, RimBurr, Wheel, WheelSpec, build_wheel, deviation_mm

_DRUM = WheelSpec("drum", ((0.0, 0.0), (0.0, 40.0), (20.0, 40.0), (20.0, 0.0)))
_RIDGE = AxialRidge(angle_deg=20.0, height_mm=0.8, width_mm=1.5, z_start_mm=5.0, z_end_mm=15.0)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6))
def test_every_motion_has_a_pose(seed: int) -> None:
    rng = np.random.default_rng(seed)
    motion_ = np.eye(4)
    motion_[:3, :3] = Rotation.random(random_state=rng).as_matrix()
    motion_[:3, 3] = 300.0 * rng.normal(size=3)
    pose = pose_of(motion_, standoff_mm=600.0, middle_z_mm=12.0)
    assert np.allclose(pose.T_camera_part(standoff_mm=600.0, middle_z_mm=12.0), motion_, atol=1e-9)


def test_attained_poses_scatter_as_the_sheet_says() -> None:
    sheet = PositionerSheet(reach_mm=1000.0)
    arm = AttainedPoses(sheet, identity=(1,), source="arm")
    there = motion(np.array([300.0, 200.0, 100.0, 0.2, 0.1, 0.3]))
    attained = np.array([(np.linalg.inv(there) @ arm.attained(there))[:3, 3] for _ in range(4000)])
    away = np.linalg.norm(attained - attained.mean(axis=0), axis=1)
    assert away.mean() + 3.0 * away.std(ddof=1) == pytest.approx(sheet.repeatability_mm, rel=0.03)


def test_accuracy_is_the_sheets_over_the_workspace_and_the_same_nearby() -> None:
    sheet = PositionerSheet(reach_mm=1000.0)
    rng = np.random.default_rng(5)
    square = []
    for identity in range(40):
        arm = AttainedPoses(sheet, identity=(identity,), source="arm")
        for _ in range(10):
            place = motion(np.concatenate([500.0 * rng.normal(size=3), rng.normal(size=3)]))
            square.append(arm.offset(place) ** 2)
            beside = place @ motion(np.array([5.0, 5.0, 5.0, 0.0, 0.0, 0.0]))
            assert np.abs(arm.offset(beside) - arm.offset(place))[:3].max() < 0.05
    root = np.sqrt(np.mean(square, axis=0).reshape(2, 3).sum(axis=1))
    assert root[0] == pytest.approx(sheet.accuracy_mm, rel=0.1)
    assert np.degrees(root[1]) == pytest.approx(sheet.accuracy_deg, rel=0.1)


@pytest.fixture(scope="module")
def cell() -> SimulatedCell:
    scene = scene_from({"wheel": "paper", "finish": "matte", "rig": {"scale": 0.1}}, source="test")
    return SimulatedCell(scene, CellSpec(), identity=(3,))


def test_a_part_is_put_down_at_any_angle() -> None:
    scene = scene_from({"wheel": "paper", "rig": {"scale": 0.1}}, source="test")
    wheel = build_wheel(scene.wheel, scene.burrs)

    def turned_deg(spec: CellSpec) -> list[float]:
        cells = [SimulatedCell(scene, spec, identity=(seed,), wheel=wheel) for seed in range(100)]
        sides = [cell.T_plate_part[:2, 0] for cell in cells]
        return [float(np.degrees(np.arctan2(side[1], side[0]))) for side in sides]

    free = np.sort(np.mod(turned_deg(CellSpec()), 360.0))
    # Kolmogorov-Smirnov at one in a thousand
    assert np.abs(free / 360.0 - (np.arange(100) + 0.5) / 100).max() < 1.95 / 10.0
    assert np.abs(turned_deg(CellSpec(turned_deg=0.0))).max() < 4.0 * CellSpec().placed_deg
    assert turned_deg(CellSpec()) == turned_deg(CellSpec())


def test_the_report_is_nearly_true(cell: SimulatedCell) -> None:
    station = cell.station()
    for pose in arm_poses(station)[:2]:
        reported = go(station, Stand(30.0, pose))
        true = cell.T_plate_part @ np.linalg.inv(cell.T_camera_part)
        off = np.linalg.inv(reported) @ true
        assert np.linalg.norm(off[:3, 3]) < 2.0
        assert np.degrees(Rotation.from_matrix(off[:3, :3]).magnitude()) < 1.0
        assert np.linalg.norm(off[:3, 3]) > 1e-3  # and not exactly


def test_poses_that_touch_or_are_too_far_are_refused(cell: SimulatedCell) -> None:
    station = cell.station()
    standing = cell.arm.T_true.copy()
    pose = np.array(arm_poses(station)[0])
    into_part, into_table, far = pose.copy(), pose.copy(), pose.copy()
    into_part[:3, 3] += 500.0 * pose[:3, 2]
    into_table[:3, 3] = station.T_base_plate[:3, 3] + [-150.0, 0.0, 5.0]
    far[:3, 3] -= 3000.0 * pose[:3, 2]
    for bad, said in ((into_part, "touch"), (into_table, "touch the table"), (far, "reaches")):
        with pytest.raises(OutOfReachError, match=said):
            go(station, Stand(0.0, bad))
        assert np.array_equal(cell.arm.T_true, standing)
    with pytest.raises(OutOfReachError, match="own axis"):
        station.table.move(motion(np.array([10.0, 0.0, 0.0, 0.0, 0.0, 0.0])) @ station.T_base_plate)
    assert station.table.move(turned(station.T_base_plate, 200.0)) is not None


def _closed(faces: Ints32) -> bool:
    """Whether every edge is walked as often one way as the other (slivers may touch themselves)."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    there, back = (np.sort(edges[:, a] << 32 | edges[:, b]) for a, b in ((0, 1), (1, 0)))
    return bool(np.array_equal(there, back))


def _over(depth_mm: float, *, mill_mm: float = 2.0) -> Cut:
    out = (np.cos(np.radians(20.0)), np.sin(np.radians(20.0)), 0.0)
    radius = 40.0 + depth_mm
    places = tuple((radius * out[0], radius * out[1], z) for z in np.arange(4.0, 16.5, 1.0))
    return Cut(places, (out,) * len(places), mill_mm, 10.0)


def test_a_cut_leaves_a_closed_wheel_as_flat_as_the_mill() -> None:
    before = build_wheel(_DRUM, [_RIDGE])
    for depth in (0.3, 0.0, -0.1):
        wheel = build_wheel(_DRUM, [_RIDGE], milled=[_over(depth)])
        assert _closed(wheel.welded()[1])
        left = left_of(wheel, before, before.burrs[0])
        # a plane over the drum: beside its middle the base of 1.5 mm stays by its sagitta, 0.007 mm
        assert left.residual_mm == pytest.approx(max(depth, 0.0), abs=0.0075)
        # a plane end cuts deepest in its middle
        assert left.gouge_mm == pytest.approx(max(-depth, 0.0), abs=0.004)
        corners = wheel.vertices_mm[wheel.faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        size = np.linalg.norm(normals, axis=1)
        inner = (normals * wheel.normals[wheel.faces].mean(axis=1)).sum(axis=1)[size > 1e-9]
        assert inner.min() > 0.0


def test_what_was_cut_away_is_the_burr() -> None:
    burred, milled_, bare = (
        trimesh.Trimesh(*build_wheel(_DRUM, burrs, milled=cuts).welded(), process=False).volume
        for burrs, cuts in (([_RIDGE], []), ([_RIDGE], [_over(0.0)]), ([], []))
    )
    assert burred - bare > 3.0
    assert milled_ - bare == pytest.approx(0.0, abs=0.05)


def _left(wheel: Wheel, *cuts: Cut) -> Left:
    return left_of(build_wheel(_DRUM, [_RIDGE], milled=cuts), wheel, wheel.burrs[0])


def _poses(depth_mm: float) -> Floats:
    cut = _over(depth_mm)
    poses = np.tile(np.eye(4), (len(cut.tips_mm), 1, 1))
    for pose, tip, axis in zip(poses, cut.tips_mm, cut.axes, strict=True):
        z = np.array(axis)
        pose[:3, :3] = np.stack([[0.0, 0.0, 1.0], np.cross(z, [0.0, 0.0, 1.0]), z], axis=1)
        pose[:3, 3] = tip
    return poses


def test_a_mill_gives_way_to_what_it_cuts_and_less_the_second_time() -> None:
    wheel = build_wheel(_DRUM, [_RIDGE])
    stiff, soft = MillSpec(stiffness_n_mm=1e9), MillSpec(stiffness_n_mm=100.0, thrust_n_mm2=30.0)
    (exact,) = milled(wheel, [], _poses(0.0), stiff)
    assert _left(wheel, exact).residual_mm < 0.0075
    (first,) = milled(wheel, [], _poses(0.0), soft)
    once = _left(wheel, first).residual_mm
    # thrust over stiffness: the ridge's section of half of 0.8 times 1.5 mm
    assert once == pytest.approx(30.0 * 0.6 / 100.0, rel=0.25)
    (again,) = milled(wheel, [first], _poses(0.0), soft)
    assert _left(wheel, first, again).residual_mm < 0.6 * once


def test_there_and_back_are_two_passes() -> None:
    wheel = build_wheel(_DRUM, [_RIDGE])
    there = _poses(0.0)
    assert len(milled(wheel, [], np.concatenate([there, there[::-1]]), MillSpec())) == 2


def test_where_the_mill_is_over_a_burr() -> None:
    wheel = build_wheel(_DRUM, [_RIDGE])
    pose = _poses(7.0)[5]
    across, normal = tool_over(pose, wheel, 0)
    assert across == pytest.approx(0.0, abs=0.01)
    assert normal == pytest.approx(7.0, abs=0.01)
    moved = pose.copy()
    moved[:3, 3] += 0.3 * np.array([-np.sin(np.radians(20.0)), np.cos(np.radians(20.0)), 0.0])
    assert tool_over(moved, wheel, 0)[0] == pytest.approx(0.3, abs=0.01)


@pytest.mark.parametrize(("height_mm", "facet_error_mm"), [(0.8, 0.05), (1.5, 0.005), (0.4, 0.05)])
def test_the_middle_of_a_plain_ridge_is_its_angle_wherever_the_mill_stands(
    height_mm: float, facet_error_mm: float
) -> None:
    """Corners of large facets, which lie on one flank or the other, once moved it by a twentieth of a mm."""
    ridge = replace(_RIDGE, height_mm=height_mm)
    wheel = build_wheel(_DRUM, [ridge], facet_error_mm=facet_error_mm)
    for z in np.arange(5.5, 15.0, 0.37):
        pose = _poses(7.0)[5].copy()
        pose[2, 3] = z
        assert tool_over(pose, wheel, 0)[0] == pytest.approx(0.0, abs=0.001)


@pytest.mark.parametrize("fillet_mm", [0.0, 0.6])
@pytest.mark.parametrize("direction", ["axial", "radial"])
def test_over_a_rim_across_counts_from_where_its_faces_meet(
    fillet_mm: float, direction: Literal["axial", "radial"]
) -> None:
    corner = (20.0, 40.0, fillet_mm) if fillet_mm else (20.0, 40.0)
    drum = WheelSpec("drum", ((0.0, 0.0), (0.0, 40.0), corner, (20.0, 0.0)))
    rim = RimBurr(angle_deg=30.0, arc_deg=20.0, height_mm=0.6, width_mm=0.8, edge=2, direction=direction)
    wheel = build_wheel(drum, [rim])
    pose, angle = np.eye(4), np.radians(33.0)
    z, r = (28.0, 40.3) if direction == "axial" else (20.3, 48.0)
    pose[:3, 3] = r * np.cos(angle), r * np.sin(angle), z
    across, normal = tool_over(pose, wheel, 0)
    assert abs(across) == pytest.approx(0.3, abs=1e-3)
    assert normal == pytest.approx(8.0, abs=1e-3)


def test_a_curled_burrs_middle_is_that_of_its_outline() -> None:
    rolled = replace(_RIDGE, section="rolled")
    wheel = build_wheel(_DRUM, [rolled])
    shape = trimesh.Trimesh(wheel.vertices_mm, wheel.faces[wheel.face_burr == 0], process=False)
    section = np.asarray(shape.section([0.0, 0.0, 1.0], [0.0, 0.0, 10.1]).vertices)
    turn = np.degrees(np.arctan2(section[:, 1], section[:, 0]))
    pose = _poses(7.0)[5].copy()
    pose[2, 3] = 10.0
    apart = np.radians(20.0 - 0.5 * (turn.min() + turn.max())) * 47.0
    assert tool_over(pose, wheel, 0)[0] == pytest.approx(apart, abs=0.02)


def test_the_ideal_surface_is_what_truth_counts_from() -> None:
    wheel = build_wheel(_DRUM, [_RIDGE], milled=[_over(0.3)])
    off = deviation_mm(wheel.vertices_mm, wheel.generatrix_zr_mm)
    assert off.max() == pytest.approx(0.3, abs=0.004)


@pytest.mark.study
@pytest.mark.parametrize("direction", ["axial", "radial"])
def test_a_burr_on_an_edge_is_reached_and_milled_off(
    direction: Literal["axial", "radial"], tmp_path: Path
) -> None:
    """The whole way with rendered looks, of a part that was moved: the arm scatters by 0.04 mm a move."""
    wheel = tmp_path / "drum.toml"
    wheel.write_text(
        'name = "drum"\ngeneratrix = [[-30.0, 15.0], [-30.0, 45.0], [25.0, 45.0, 0.3], [25.0, 15.0]]\n'
    )
    rim = {"kind": "rim", "angle_deg": 30.0, "arc_deg": 25.0, "height_mm": 0.8, "width_mm": 0.9, "edge": 2}
    document = {
        "wheel": str(wheel), "rig": {"scale": 0.5}, "finish": "matte",
        "burr": [{**rim, "direction": direction}],
    }  # fmt: skip
    cell = SimulatedCell(scene_from(document, source="here"), CellSpec(), identity=(5,))
    station, truth = cell.station(), cell.wheel.burrs[0]
    angle, (z, r) = np.radians(30.0), (25.0, 45.0)
    radial, around = np.array([np.cos(angle), np.sin(angle), 0.0]), [-np.sin(angle), np.cos(angle), 0.0]
    up = np.array([0.0, 0.0, 1.0]) if direction == "axial" else radial
    pose = np.eye(4)
    pose[:3, :3] = np.stack([around, np.cross(up, around), up], axis=1)
    pose[:3, 3] = r * radial + [0.0, 0.0, z]
    known = replace(
        stated_burr(truth, pose), height_mm=Value(1.0, 0.3), width_mm=Value(1.5, 0.5), side="protrusion"
    )
    where = cell.T_plate_part @ pose
    cell.disturb()
    reached = servo(station, known, where)
    assert reached.converged, reached.why
    across, normal = tool_over(cell.T_part_tool, cell.wheel, 0)
    assert max(abs(across), abs(normal - reached.glances[-1].height_mm)) < 0.08
    path = along_its_edge(station, path_of(station, reached, radius_mm=2.0), reached)
    mill(station, path, reached)
    left = left_of(cell.seen().truth.wheel, cell.wheel, truth)
    assert left.residual_mm < 0.1
    assert left.gouge_mm < 0.1
