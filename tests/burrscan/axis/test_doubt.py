"""An axis that may be another one altogether says so, and is not given."""

import numpy as np
import pytest

from bench.synthetic.depth_view import single_view
from bench.synthetic.revolution import axis_angle_deg, revolution_scan
from burrscan.arrays import Floats, Ints32
from burrscan.axis import find_axis
from burrscan.axis.fitting.doubt import gross_probability, others
from burrscan.axis.fitting.fit import Fit, refine
from burrscan.errors import InputError


def fits() -> tuple[Fit, Fit, float]:
    """The fit of a wheel's axis and one of a line across it, and the weight of the points."""
    scan = revolution_scan(shape=(120, 40), sigma_mm=0.2, seed=2)
    points = (scan.vertices_mm - scan.point_mm) / 90.0
    alike, across = np.ones(len(points)), np.cross(scan.direction, [0.3, 0.5, 0.8])
    right, wrong = (
        refine(points, alike, direction / np.linalg.norm(direction), np.zeros(3), blur=0.03, steps=2)
        for direction in (scan.direction, across)
    )
    return right, wrong, float(len(points))


def test_probability_is_the_ratio_of_likelihoods() -> None:
    right, wrong, total = fits()
    wrong.sigma, wrong.inliers = 1.1 * right.sigma, right.inliers
    for independent in (1.0, 10.0, 100.0):
        expected = 1.0 / (1.0 + 1.1**independent)
        found = gross_probability(right, [wrong], total=total, independent=independent)
        assert found == pytest.approx(expected, rel=1e-9)
    assert gross_probability(wrong, [right], total=total, independent=1e6) == 1.0
    assert gross_probability(right, [], total=total, independent=10.0) == 0.0


def test_rivals_are_of_other_axes_and_each_once() -> None:
    right, wrong, total = fits()
    assert others(right, [right, wrong, wrong, right], total) == [wrong]


def fluted(flutes: int, depth: float) -> tuple[Floats, Ints32]:
    """A vase about z, its radius waved around by so much of itself."""
    z, turn = np.linspace(-60.0, 60.0, 80), 2.0 * np.pi * np.arange(720) / 720
    radius = (45.0 + 8.0 * np.sin(z / 17.0))[:, None] * (1.0 + depth * np.cos(flutes * turn))
    points = np.stack(
        [radius * np.cos(turn), radius * np.sin(turn), np.repeat(z[:, None], 720, axis=1)], axis=-1
    )
    index = np.arange(80 * 720, dtype=np.int32).reshape(80, 720)
    a, b = index[:-1], np.roll(index, -1, axis=1)[:-1]
    c, d = index[1:], np.roll(index, -1, axis=1)[1:]
    return points.reshape(-1, 3), np.stack([a, c, b, b, c, d], axis=-1).reshape(-1, 3)


def test_fluted_vases_do_not_bluff() -> None:
    """24 views. Most fit other axes as well: 73 to 90 degrees off, with a sigma of 0.3 to 3 degrees."""
    refused = 0
    for seed, view in enumerate(np.random.default_rng(3).normal(size=(24, 3))):
        vertices, faces = fluted(7 + seed % 5, 0.06)
        points, triangles = single_view(vertices, faces, view, pixels=160, sigma=0.1, seed=seed)
        axis = find_axis(points, triangles, most_doubt=1.0)
        if axis.undetermined == () and axis.gross_probability > 0.001:
            with pytest.raises(InputError, match=r"another one: .* through .*, but also .* through"):
                find_axis(points, triangles)
            refused += 1
        elif axis.undetermined == ():
            assert axis_angle_deg(axis.direction, np.eye(3)[2]) < max(1.0, 5.0 * axis.sigma_deg), view
    assert refused > 12


def test_a_clean_wheel_is_not_doubted() -> None:
    for seed in range(4):
        scan = revolution_scan(sigma_mm=0.2, shape=(200, 80), seed=seed)
        assert find_axis(scan.vertices_mm, scan.faces).gross_probability < 1e-6
