"""The part frame: the same after noise, for every direction but those on the cut that is stated."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import burrscan
from bench.synthetic.revolution import RidgeBurr, revolution_scan
from burrscan.arrays import Floats
from burrscan.axis.basis import SENSE, T_part_mesh, origin_mm, perpendicular_basis, sensed
from tests.tiers import some_of

TILT = np.radians(0.01)
SIGNS = [np.array(each, float) for each in itertools.product((-1, 0, 1), repeat=3) if any(each)]
SPECIAL = sorted((each / np.linalg.norm(each) for each in SIGNS), key=np.count_nonzero)
"""Coordinate axes first, then the diagonals of a cube's faces, then its own."""


def everywhere(count: int = 4000) -> list[Floats]:
    random = np.random.default_rng(5).normal(size=(count, 3))
    return [*SPECIAL, *(random / np.linalg.norm(random, axis=1, keepdims=True))]


def clearance_deg(direction: Floats) -> float:
    """Angle from the cut."""
    return float(np.degrees(np.arcsin(abs(direction @ SENSE) / np.linalg.norm(SENSE))))


def tilted(direction: Floats, tilt: float, turn: float) -> Floats:
    basis = perpendicular_basis(direction)
    moved = direction + np.tan(tilt) * (np.cos(turn) * basis[:, 0] + np.sin(turn) * basis[:, 1])
    return np.asarray(moved / np.linalg.norm(moved))


def burr_moves(first: Floats, second: Floats) -> tuple[float, float]:
    """How much angle (deg) and z (mm) of burrs all round a wheel at the origin change, at worst."""
    frames = [T_part_mesh(np.zeros(3), sensed(direction)) for direction in (first, second)]
    basis = perpendicular_basis(sensed(first))
    angles = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
    places = 100.0 * (np.cos(angles)[:, None] * basis[:, 0] + np.sin(angles)[:, None] * basis[:, 1])
    (a, b) = (places @ frame[:3, :3].T + frame[:3, 3] for frame in frames)
    turn = np.angle(np.exp(1j * (np.arctan2(a[:, 1], a[:, 0]) - np.arctan2(b[:, 1], b[:, 0]))))
    return float(np.degrees(np.abs(turn)).max()), float(np.abs(a[:, 2] - b[:, 2]).max())


def test_the_special_directions_are_far_from_the_cut() -> None:
    least = {k: min(clearance_deg(d) for d in SPECIAL if np.count_nonzero(d) == k) for k in (1, 2, 3)}
    assert least[1] > 12.5
    assert least[2] > 8.7
    assert least[3] > 7.1


@some_of("sign", [1.0, -1.0])
def test_a_tilt_of_a_hundredth_of_a_degree_turns_no_burr(sign: float) -> None:
    """Over all directions that a tilt does not carry over the cut; a method may give either sign."""
    for direction in everywhere():
        if clearance_deg(direction) < 0.02:
            continue
        for turn in (0.0, 1.0, 2.0, 4.0):
            angle_deg, z_mm = burr_moves(direction, sign * tilted(direction, TILT, turn))
            assert angle_deg < 0.0175, direction
            assert z_mm < 1.01 * 100.0 * TILT


def test_the_only_cut_is_where_it_is_stated() -> None:
    on_cut = np.cross(SENSE, [0.3, -0.2, 0.7])
    on_cut /= np.linalg.norm(on_cut)
    s = np.array(SENSE) / np.linalg.norm(SENSE)
    above, below = (on_cut + sign * 1e-6 * s for sign in (1.0, -1.0))
    angle_deg, z_mm = burr_moves(above / np.linalg.norm(above), below / np.linalg.norm(below))
    assert angle_deg > 1.0 or z_mm > 1.0
    np.testing.assert_allclose(sensed(above), above)
    np.testing.assert_allclose(sensed(below), -below)


def test_the_frame_is_right_handed_everywhere() -> None:
    for direction in [*everywhere(200), np.array([0.0, 0.0, -1.0])]:
        turn = np.column_stack([perpendicular_basis(direction), direction])
        np.testing.assert_allclose(turn.T @ turn, np.eye(3), atol=1e-9)
        assert np.linalg.det(turn) == pytest.approx(1.0)


def test_a_part_drawn_along_a_coordinate_axis_keeps_its_own() -> None:
    np.testing.assert_allclose(T_part_mesh(np.array([0.0, 0.0, 7.0]), np.array([0.0, 0.0, 1.0])), np.eye(4))
    for axis, zero in (([0.0, 1.0, 0.0], [1.0, 0.0, 0.0]), ([1.0, 0.0, 0.0], [0.0, 0.0, -1.0])):
        np.testing.assert_allclose(perpendicular_basis(np.array(axis))[:, 0], zero, atol=1e-15)


def test_z_counts_from_the_meshs_origin_wherever_the_data_are() -> None:
    direction = sensed(np.array([0.6, 0.0, 0.8]))
    for along in (-40.0, 0.0, 300.0):
        point = np.array([0.0, 5.0, 0.0]) + along * direction
        part = T_part_mesh(point, direction)
        np.testing.assert_allclose(
            part @ [*origin_mm(point, direction), 1.0], [0.0, 0.0, 0.0, 1.0], atol=1e-9
        )
        np.testing.assert_allclose(origin_mm(point, direction), [0.0, 5.0, 0.0], atol=1e-9)


@some_of(
    "direction",
    [
        SPECIAL[1],
        *(pytest.param(one, marks=pytest.mark.study) for one in (SPECIAL[2], SPECIAL[20])),
        *(pytest.param(one, marks=pytest.mark.study) for one in SPECIAL[:1] + SPECIAL[3:6] + SPECIAL[6:26:5]),
    ],
    ids=str,
)
def test_noise_turns_no_burr_of_a_whole_inspection(direction: Floats) -> None:
    """Five micrometres flipped a burr's angle from 10 to -80 degrees, its z by the data's, its own x axis."""
    seen, along = [], []
    for seed in (1, 2):
        scan = revolution_scan(
            sigma_mm=0.005, seed=seed, shape=(300, 80), burrs=(RidgeBurr(angle_deg=10.0, z_end_mm=0.0),)
        )
        local = (scan.vertices_mm - scan.point_mm) @ scan.T_mesh_part[:3, :3]
        turn = np.column_stack([perpendicular_basis(direction), direction])
        (burr,) = burrscan.inspect_mesh(local @ turn.T, scan.faces, sigma_mm=0.005).burrs
        seen.append((burr.angle_deg.value, burr.z_start_mm.value, burr.z_end_mm.value))
        along.append(burr.T_mesh_burr[:3, 0])
    assert along[0] @ along[1] == pytest.approx(1.0, abs=1e-3)
    assert seen[0][0] == pytest.approx(seen[1][0], abs=0.02)
    assert seen[0][1:] == pytest.approx(seen[1][1:], abs=0.1)
    if direction[2] == 1.0:
        assert seen[0][0] == pytest.approx(10.0, abs=0.1)
        assert seen[0][1:] == pytest.approx((-30.0, 0.0), abs=1.0)
