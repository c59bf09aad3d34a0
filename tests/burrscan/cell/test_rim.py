"""Edges of a curve, and burrs that stand on them."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from burrscan.arrays import Floats
from burrscan.axis.basis import T_part_mesh
from burrscan.cell.rim import Edge, along_edge, edge_near, on_its_edge, pose_over, standing
from burrscan.cell.track import Tracked, tracked
from burrscan.generatrix import deviation_mm
from burrscan.inspection import Generatrix, Inspection, Value
from burrscan.pipeline import Outcome
from burrscan.rig import Rig
from tests.burrscan.cell.parts import axis, burr

_TOP_MM, _RADIUS_MM, _ROUND_MM = 35.0, 45.0, 0.4
_NOISE_MM = 0.01


def curve(seed: int = 0, *, noise_mm: float = 0.0) -> Generatrix:
    """A drum's side, its rounded edge, its end face, a corner and a hub on that: material to the right."""
    turn = np.linspace(0.0, np.pi / 2.0, 9)[1:-1]
    inner = _RADIUS_MM - _ROUND_MM
    side = np.stack([np.linspace(0.0, _TOP_MM - _ROUND_MM, 100), np.full(100, _RADIUS_MM)], axis=1)
    edge = [_TOP_MM - _ROUND_MM, inner] + _ROUND_MM * np.stack([np.sin(turn), np.cos(turn)], axis=1)
    face = np.stack([np.full(60, _TOP_MM), np.linspace(inner, 30.0, 60)], axis=1)
    hub = np.stack([np.linspace(_TOP_MM, _TOP_MM + 4.0, 20)[1:], np.full(19, 30.0)], axis=1)
    end = np.stack([np.full(40, _TOP_MM + 4.0), np.linspace(30.0, 10.0, 40)], axis=1)[1:]
    whole = np.concatenate([side, edge, face, hub, end])
    z, r = (whole + noise_mm * np.random.default_rng(seed).normal(size=whole.shape)).T
    known = np.full(len(z), max(noise_mm, 1e-3))
    return Generatrix(z, r, known, known)


def edge_of(near_mm: list[float], *, within_mm: float = 6.0, noise_mm: float = 0.0) -> Edge | None:
    line = curve(noise_mm=noise_mm)
    return edge_near(line, np.array(near_mm), within_mm=within_mm)


@pytest.mark.parametrize("near_mm", [[35.0, 45.0], [32.0, 43.0], [36.0, 48.0]])
def test_an_edge_is_where_its_faces_meet_rounded_or_not(near_mm: list[float]) -> None:
    found = edge_of(near_mm, noise_mm=0.005)
    assert found is not None
    assert found.at_mm == pytest.approx([_TOP_MM, _RADIUS_MM], abs=0.01)
    normals = np.array([face.normal for face in found.faces])
    assert np.abs(normals).max(axis=0) == pytest.approx([1.0, 1.0], abs=0.005)
    assert (normals.sum(axis=0) > 0.9).all()  # out of the part


def test_a_curve_that_stands_over_its_edge_tells_it_as_well() -> None:
    """By 0.07 mm over its last 0.7 mm, as one that was fitted around a sharp edge does."""
    line = curve(noise_mm=0.005)
    over = np.clip((line.z_mm - (_TOP_MM - 1.1)) / 0.7, 0.0, 1.0) * (line.r_mm > _RADIUS_MM - 0.05)
    line = replace(line, r_mm=line.r_mm + 0.07 * over)
    found = edge_near(line, np.array([_TOP_MM, _RADIUS_MM]), within_mm=3.0)
    assert found is not None
    assert found.at_mm == pytest.approx([_TOP_MM, _RADIUS_MM], abs=0.01)


def test_the_nearer_of_two_edges_is_taken_and_no_corner() -> None:
    hub = edge_of([38.0, 31.0])
    assert hub is not None
    assert hub.at_mm == pytest.approx([_TOP_MM + 4.0, 30.0], abs=0.01)
    assert edge_of([34.0, 31.0], within_mm=3.0) is None  # face and hub meet there, in a corner
    assert edge_of([10.0, 45.0]) is None  # a side without an edge
    apart = edge_of([38.5, 42.0], within_mm=7.5)  # the hub's end and the side would meet nearer, at 39, 45
    assert apart is not None
    assert apart.at_mm == pytest.approx([_TOP_MM, _RADIUS_MM], abs=0.01)


def points_of(
    rng: np.random.Generator, *, at_deg: float, arc_mm: float, direction: str, seen: float = 1.0
) -> tuple[Floats, Floats]:
    """(N, 3) a drum's end face and side beside its edge, with a rim of 0.8 mm; and their deviations.

    Of the rim a share ``seen`` is measured where it is, the rest at its foot.
    """
    angle = rng.uniform(-np.pi, np.pi, 60_000)
    inward = np.abs(rng.uniform(-4.0, 4.0, len(angle)))
    on_face = rng.uniform(size=len(angle)) < 0.5
    z = np.where(on_face, _TOP_MM, _TOP_MM - inward)
    r = np.where(on_face, _RADIUS_MM - inward, _RADIUS_MM)
    off = (angle - np.radians(at_deg) + np.pi) % (2.0 * np.pi) - np.pi
    rim = (np.abs(off) * _RADIUS_MM < 0.5 * arc_mm) & (inward < 0.6) & (on_face == (direction == "axial"))
    lift = np.where(rim & (rng.uniform(size=len(angle)) < seen), 0.8 * (1.0 - inward / 0.6), 0.0)
    lift += _NOISE_MM * rng.normal(size=len(angle))
    z, r = z + np.where(on_face, lift, 0.0), r + np.where(on_face, 0.0, lift)
    return np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1), lift


def rim(at_deg: float, outward: list[float]) -> Floats:
    """(4, 4) a pose around the axis near the edge, its z (z, r)."""
    angle = np.radians(at_deg)
    radial = np.array([np.cos(angle), np.sin(angle), 0.0])
    z_axis = outward[1] * radial + [0.0, 0.0, outward[0]]
    x_axis = np.array([-np.sin(angle), np.cos(angle), 0.0])
    pose = np.eye(4)
    pose[:3, :3] = np.stack([x_axis, np.cross(z_axis, x_axis), z_axis], axis=1)
    pose[:3, 3] = (_RADIUS_MM - 0.5) * radial + [0.0, 0.0, _TOP_MM + 0.4]
    return pose


@pytest.mark.parametrize(("direction", "normal"), [("axial", [1.0, 0.0]), ("radial", [0.0, 1.0])])
def test_a_burr_stands_up_from_the_face_that_its_points_are_over(direction: str, normal: list[float]) -> None:
    points, deviation = points_of(np.random.default_rng(1), at_deg=20.0, arc_mm=15.0, direction=direction)
    found = edge_of([_TOP_MM, _RADIUS_MM])
    assert found is not None
    half = np.sqrt(0.5)
    pose = rim(20.0, [half, half])
    face = standing(found, pose, points, deviation, high_mm=0.8, half_mm=7.5)
    assert face is not None
    assert face.normal == pytest.approx(normal, abs=0.005)
    assert standing(found, rim(120.0, [half, half]), points, deviation, high_mm=0.8, half_mm=7.5) is None


def test_a_call_beside_an_edge_is_put_on_it_and_one_elsewhere_stays() -> None:
    points, deviation = points_of(np.random.default_rng(6), at_deg=20.0, arc_mm=15.0, direction="axial")
    given = rim(20.0, [np.sqrt(0.5), np.sqrt(0.5)])
    pose = on_its_edge(curve(), given, points, deviation, high_mm=0.8, half_mm=7.5)
    assert [pose[2, 3], np.hypot(*pose[:2, 3])] == pytest.approx([_TOP_MM, _RADIUS_MM], abs=1e-3)
    assert pose[:3, 2] == pytest.approx([0.0, 0.0, 1.0], abs=1e-3)
    far = np.array(given)
    far[2, 3] -= 20.0
    for other in (far, rim(120.0, [1.0, 0.0])):  # without an edge, and without points
        same = on_its_edge(curve(), other, points, deviation, high_mm=0.8, half_mm=7.5)
        assert same == pytest.approx(other)


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_the_pose_is_on_the_edge_and_keeps_the_burrs_sense(sense: float) -> None:
    found = edge_of([_TOP_MM, _RADIUS_MM])
    assert found is not None
    given = rim(20.0, [1.0, 0.0])
    given[:3, :2] *= sense
    face = max(found.faces, key=lambda one: one.normal[0])
    pose = pose_over(found, face, given, along_mm=5.0)
    angle = np.radians(20.0) + sense * 5.0 / _RADIUS_MM
    there = [_RADIUS_MM * np.cos(angle), _RADIUS_MM * np.sin(angle), _TOP_MM]
    assert pose[:3, 3] == pytest.approx(there, abs=1e-3)
    assert pose[:3, 2] == pytest.approx([0.0, 0.0, 1.0], abs=1e-3)
    assert pose[:3, 0] @ given[:3, 0] > 0.9
    assert pose[:3, :3] @ pose[:3, :3].T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)


def shifted(rng: np.random.Generator, by_mm: float, *, seen: float) -> float | None:
    points, deviation = points_of(
        rng, at_deg=20.0 + np.degrees(by_mm / _RADIUS_MM), arc_mm=16.0, direction="axial", seen=seen
    )
    found = edge_of([_TOP_MM, _RADIUS_MM])
    assert found is not None
    sigma = np.full(len(points), _NOISE_MM)
    return along_edge(
        found, rim(20.0, [1.0, 0.0]), points, deviation, sigma, high_mm=0.8, half_mm=8.0, gate_mm=6.0
    )


@pytest.mark.parametrize("by_mm", [-4.0, 0.0, 4.0])
def test_a_burr_is_found_along_its_edge_of_which_a_third_is_measured(by_mm: float) -> None:
    rng = np.random.default_rng(2)
    for _ in range(5):
        assert shifted(rng, by_mm, seen=0.3) == pytest.approx(by_mm, abs=1.5)


def test_of_stretches_that_are_as_good_the_nearest_is_taken_and_of_nothing_none() -> None:
    rng = np.random.default_rng(3)
    moved = [shifted(rng, 1.0, seen=0.02) for _ in range(20)]
    assert np.mean([one is not None and 0.0 <= one <= 1.5 for one in moved]) > 0.8
    assert np.mean([one == 0.0 for one in moved]) > 0.4
    assert [shifted(rng, 0.0, seen=0.0) for _ in range(5)] == [None] * 5


def test_where_less_stands_out_than_elsewhere_there_is_no_burr() -> None:
    points, deviation = points_of(np.random.default_rng(8), at_deg=20.0, arc_mm=16.0, direction="axial")
    found = edge_of([_TOP_MM, _RADIUS_MM])
    assert found is not None
    sigma = np.full(len(points), _NOISE_MM)
    at = np.degrees(np.arctan2(points[:, 1], points[:, 0]))
    rough = np.where((np.abs(at - 20.0) > 15.0) & (np.arange(len(points)) % 50 == 0), 0.5, 0.0)
    bare = np.where(np.abs(at - 20.0) < 12.0, 0.0, deviation) + rough
    pose = rim(20.0, [1.0, 0.0])
    assert along_edge(found, pose, points, bare, sigma, high_mm=0.8, half_mm=8.0, gate_mm=2.0) is None


def look_at(
    rng: np.random.Generator, by_mm: Floats, *, at_deg: float = 20.0, gate_mm: float = 3.0
) -> Tracked | None:
    """The rim as a look finds it whose part, seen in its own frame, was moved by (z, r) mm."""
    points, _ = points_of(rng, at_deg=at_deg, arc_mm=16.0, direction="axial", seen=0.3)
    line, centre = curve(noise_mm=0.003), axis()
    line = replace(line, z_mm=line.z_mm + by_mm[0], r_mm=line.r_mm + by_mm[1])
    out = points[:, :2] / np.hypot(points[:, 0], points[:, 1])[:, None]
    points = points + np.column_stack([by_mm[1] * out, np.full(len(points), by_mm[0])])
    surface = SimpleNamespace(vertices_mm=points, vertex_sigma_mm=np.full(len(points), _NOISE_MM))
    frame = T_part_mesh(centre.point_mm, centre.direction)
    inspection = Inspection(centre, line, (), frame, deviation_mm(points, centre, line))
    outcome = cast(Outcome, SimpleNamespace(scan=None, surface=surface, inspection=inspection))
    wanted = replace(
        burr(20.0), T_mesh_burr=rim(20.0, [1.0, 0.0]), height_mm=Value(0.8, 0.1), length_mm=Value(16.0, 0.5)
    )
    rig = cast(Rig, SimpleNamespace())
    return tracked(outcome, wanted, wanted.T_mesh_burr, rig=rig, gate_mm=gate_mm, pixel_mm=0.4)


@pytest.mark.parametrize("by_mm", [[0.0, 0.0], [1.5, -0.7]])
def test_a_look_finds_the_edge_where_it_is_to_hundredths(by_mm: list[float]) -> None:
    found = look_at(np.random.default_rng(4), np.array(by_mm))
    assert found is not None
    x, y, z = found.burr.T_mesh_burr[:3, 3]
    assert [z, np.hypot(x, y)] == pytest.approx([_TOP_MM + by_mm[0], _RADIUS_MM + by_mm[1]], abs=0.02)
    assert found.burr.T_mesh_burr[:3, 2] == pytest.approx([0.0, 0.0, 1.0], abs=0.01)
    assert 0.01 < found.across_sigma_mm < 0.03


def test_beyond_the_gate_there_is_no_edge() -> None:
    assert look_at(np.random.default_rng(5), np.array([5.0, 0.0])) is None


@pytest.mark.parametrize(("gate_mm", "moved"), [(6.0, True), (2.0, False)])
def test_along_its_edge_a_burr_is_moved_when_it_is_first_found(gate_mm: float, *, moved: bool) -> None:
    found = look_at(np.random.default_rng(9), np.zeros(2), at_deg=22.0, gate_mm=gate_mm)
    assert found is not None
    x, y = found.burr.T_mesh_burr[:2, 3]
    by_mm = np.radians(2.0) * _RADIUS_MM
    off_mm = (np.arctan2(y, x) - np.radians(20.0)) * _RADIUS_MM
    assert off_mm == pytest.approx(by_mm if moved else 0.0, abs=0.8 if moved else 1e-6)
