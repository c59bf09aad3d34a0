"""Where rays meet a surface of revolution: against formulas, and against triangles of the same surface."""

from __future__ import annotations

import numpy as np
import pytest

from burrscan.arrays import Floats
from burrscan.generatrix import ray
from burrscan.generatrix.polyline import join, revolved
from burrscan.generatrix.ray import first_met

_Z = (-30.0, -30.0, -12.0, 14.0, 14.0, 30.0, 30.0, -30.0)
_R = (25.0, 80.0, 80.0, 100.0, 90.0, 60.0, 25.0, 25.0)
WHEEL = np.stack([_Z, _R], axis=1)
"""Two discs, a bore, cylinders, cones of either slope and inner corners."""


def spread(count: int, seed: int) -> tuple[Floats, Floats]:
    """Rays from places in and around the wheel in all directions, of various lengths."""
    rng = np.random.default_rng(seed)
    return rng.normal(size=(count, 3)) * 70.0, rng.normal(size=(count, 3)) * rng.uniform(0.2, 3.0, (count, 1))


@pytest.mark.parametrize(
    ("direction", "distance", "segment"),
    [
        ((0.0, -1.0, 0.0), 120.0, 0),  # the cylinder, from outside
        ((0.0, -2.0, 0.0), 60.0, 0),  # distances are counted in lengths of the direction
        ((0.0, 1.0, 0.0), np.inf, -1),
        ((0.0, 0.0, -1.0), np.inf, -1),
        ((0.0, -1.0, -1.0), 120.0, 0),
    ],
)
def test_rays_by_hand(direction: tuple[float, float, float], distance: float, segment: int) -> None:
    line = join([np.array([[-200.0, 80.0], [20.0, 80.0], [20.0, 30.0]])])
    far, met = first_met(line, np.array([[0.0, 200.0, 0.0]]), np.array([direction]), beyond_mm=0.0)
    assert far[0] == pytest.approx(distance)
    assert met[0] == segment


def test_a_disc_is_met_between_its_radii() -> None:
    line = join([np.array([[20.0, 30.0], [20.0, 80.0]])])
    origin = np.array([[50.0, 0.0, 60.0], [20.0, 0.0, 60.0], [0.0, -90.0, 60.0]])
    far, met = first_met(line, origin, np.tile([0.0, 0.0, -1.0], (3, 1)), beyond_mm=0.0)
    assert far.tolist() == [40.0, np.inf, np.inf]
    assert met.tolist() == [0, -1, -1]


def nearest_triangle(corners: Floats, origin: Floats, direction: Floats) -> tuple[float, int]:
    """Möller and Trumbore (1997): how far a ray goes to the first of (F, 3, 3) triangles, and to which."""
    first, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(direction, v)
    scale = (u * normal).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        away = origin - first
        a = (away * normal).sum(axis=1) / scale
        turned = np.cross(away, u)
        b, far = turned @ direction / scale, (v * turned).sum(axis=1) / scale
        far = np.where((a >= 0.0) & (b >= 0.0) & (a + b <= 1.0) & (far > 0.0), far, np.inf)
    return float(far.min()), int(far.argmin())


@pytest.mark.parametrize("seed", range(3))
def test_triangles_of_the_same_surface_are_met_there(seed: int) -> None:
    """1,024 flats for a turn: their chords lie half a micrometre inside."""
    turn = np.linspace(0.0, 2.0 * np.pi, 1025)
    rows = revolved(WHEEL, turn)
    a, b, c, d = rows[:-1, :-1], rows[1:, :-1], rows[1:, 1:], rows[:-1, 1:]
    corners = np.stack([np.stack([a, b, c], axis=-2), np.stack([a, c, d], axis=-2)], axis=2)
    strip = np.repeat(np.arange(len(WHEEL) - 1), corners[0].size // 9)
    origin, direction = spread(150, seed)
    expected = [
        nearest_triangle(corners.reshape(-1, 3, 3), *each) for each in zip(origin, direction, strict=True)
    ]
    far, segment = first_met(join([WHEEL]), origin, direction, beyond_mm=0.0)
    assert 0.2 < np.isfinite(far).mean() < 0.9
    np.testing.assert_allclose(far, [each for each, _ in expected], atol=0.01)
    met = segment >= 0
    np.testing.assert_array_equal(segment[met], strip[[face for _, face in expected]][met])


def test_rays_in_blocks_are_met_as_each_by_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    line = join([WHEEL])
    whole = first_met(line, *spread(50, 7), beyond_mm=0.0)
    monkeypatch.setattr(ray, "_MOST_PAIRS", 3 * len(line.starts))
    for blocked, at_once in zip(first_met(line, *spread(50, 7), beyond_mm=0.0), whole, strict=True):
        np.testing.assert_array_equal(blocked, at_once)
    assert [each.shape for each in first_met(line, np.empty((0, 3)), np.empty((0, 3)), beyond_mm=0.0)] == [
        (0,)
    ] * 2


def test_a_ray_leaves_what_it_starts_on() -> None:
    line = join([np.array([[-50.0, 40.0], [50.0, 40.0]])])
    inside, across = np.array([[40.0, 0.0, 0.0]]), np.array([[-1.0, 0.0, 0.0]])
    assert first_met(line, inside, across, beyond_mm=1e-3)[0][0] == pytest.approx(80.0)
    assert first_met(line, inside, -across, beyond_mm=1e-3)[0][0] == np.inf


def test_a_cone_has_no_other_half() -> None:
    """The equation of a cone holds beyond its tip as well, where the radius would be negative."""
    line = join([np.array([[0.0, 50.0], [40.0, 10.0]])])
    origin, direction = np.array([[80.0, 0.0, 75.0]]), np.array([[-1.0, 0.0, 0.0]])
    assert first_met(line, origin, direction, beyond_mm=0.0)[1][0] == -1
