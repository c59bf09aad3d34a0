"""Poses of several views, against known ones; and what is left to the robot's word."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from burrscan.arrays import Floats
from burrscan.registration import Alignment, PosedSurface, align, merge
from tests.burrscan.registration.views import part, true_pose, view

TURNS = (0.0, 80.0, 190.0, 270.0)


def views(seed: int, turns: tuple[float, ...] = TURNS, **options: float) -> list[PosedSurface]:
    rng = np.random.default_rng(seed)
    return [view(turn, rng, **options) for turn in turns]


def errors(found: Alignment, turns: tuple[float, ...] = TURNS) -> Floats:
    """(N-1, 6) rotation vector in rad and translation at the origin, mm, of each pose against the first."""
    off = [found.T_world_camera[n] @ np.linalg.inv(true_pose(turn)) for n, turn in enumerate(turns)]
    relative = [np.linalg.inv(off[0]) @ one for one in off[1:]]
    return np.array([[*Rotation.from_matrix(m[:3, :3]).as_rotvec(), *m[:3, 3]] for m in relative])


def test_views_of_a_part_that_is_not_round_are_put_where_they_were() -> None:
    """Rough: 0.2 degrees and 0.5 mm. Noise 0.02 mm on some 6,000 vertices a view."""
    found = align(views(0))
    off = errors(found)
    assert np.degrees(np.abs(off[:, :3])).max() < 0.03
    assert np.abs(off[:, 3:]).max() < 0.02
    assert found.rms_mm < 0.03
    assert found.overlap[0, 1] > 0.2
    assert found.overlap[0, 2] < 0.2


@pytest.mark.study
def test_the_stated_covariance_is_that_of_the_errors() -> None:
    """Rotations over eight runs: their mean squared pull, 72 values, is 1 within 4.5 of its own sigma."""
    pulls = []
    for seed in range(8):
        found = align(views(seed))
        sigma = np.sqrt(np.diagonal(found.covariance[1:], axis1=1, axis2=2))
        pulls.append(errors(found)[:, :3] / sigma[:, :3])
    square = np.square(pulls)
    assert abs(square.mean() - 1.0) < 4.5 * np.sqrt(2.0 / square.size)


def test_a_round_part_leaves_its_turn_to_the_robot() -> None:
    """Lobes or none: everything else is found as well, and the stated sigma of the turn says so."""
    round_part, lobed = (align(views(3, (0.0, 60.0), lobes=lobes)) for lobes in (0.0, 1.0))
    turn = [np.degrees(np.sqrt(found.covariance[1, 2, 2])) for found in (round_part, lobed)]
    assert turn[0] > 8.0 * turn[1]
    assert np.degrees(np.abs(errors(round_part, (0.0, 60.0))[0, :2])).max() < 0.01
    assert np.degrees(abs(errors(round_part, (0.0, 60.0))[0, 2])) < 4.0 * turn[0]


@pytest.mark.study
@pytest.mark.parametrize("step_mm", [1.5, 0.3])
def test_round_views_do_not_creep_about_their_axis(step_mm: float) -> None:
    """Diagonals lean one way; noise along rays moves vertices sideways; 0.3 mm is below the pitch."""
    turns, off, stated = (0.0, 60.0, 120.0), [], []
    for seed in range(6):
        found = align(views(seed, turns, lobes=0.0, step_mm=step_mm))
        off.append(errors(found, turns))
        stated.append(np.sqrt(np.diagonal(found.covariance[1:], axis1=1, axis2=2)))
    turned = np.array(off)[:, 1, 2] / np.array(stated)[:, 1, 2]
    assert abs(turned.mean()) < 4.0 / np.sqrt(len(turned))  # no bias, as far as six runs tell: 4 sigma
    assert np.abs(np.array(off)[:, :, 5] / np.array(stated)[:, :, 5]).max() < 4.0  # along the axis


def test_how_views_lie_to_each_other_does_not_depend_on_their_order() -> None:
    given = views(5)
    order = [2, 0, 3, 1]
    one, other = align(given), align([given[k] for k in order])
    first = np.linalg.inv(one.T_world_camera[order[0]]) @ one.T_world_camera[order]
    second = np.linalg.inv(other.T_world_camera[0]) @ other.T_world_camera
    np.testing.assert_allclose(first, second, atol=2e-3)  # mm at the camera, 400 mm away: 0.02 of the noise


def test_the_merged_mesh_is_the_part() -> None:
    given = [replace(one, T_world_camera=true_pose(turn)) for one, turn in zip(views(2), TURNS, strict=True)]
    merged = merge(given, align([given[0], *views(2)[1:]]))
    phi = np.arctan2(merged.vertices_mm[:, 1], merged.vertices_mm[:, 0])
    true = part(phi, merged.vertices_mm[:, 2], lobes=1.0)
    off = np.hypot(*merged.vertices_mm.T[:2]) - np.hypot(*true.T[:2])
    assert np.sqrt(np.mean(off**2)) < 0.035
    assert merged.faces.max() == len(merged.vertices_mm) - 1
    assert not np.ptp(merged.view[merged.faces], axis=1).any()  # no face joins two views
