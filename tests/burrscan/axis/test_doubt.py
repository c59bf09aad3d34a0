"""An axis that may be another one altogether says so, and is not given."""

import numpy as np
import pytest

from bench.synthetic.depth_view import single_view
from bench.synthetic.revolution import axis_angle_deg, revolution_scan
from burrscan.arrays import Floats, Ints32
from burrscan.axis import find_axis
from burrscan.axis.fitting.doubt import gross_probability, independent_errors, off_probability, others
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
    for independent in (1.0, 10.0, 100.0):
        expected = 1.0 / (1.0 + 1.1**independent)
        found = gross_probability(2.0, [2.0 + np.log(1.1)], independent=independent)
        assert found == pytest.approx(expected, rel=1e-9)
    assert gross_probability(0.5, [0.5, 0.5, 30.0], independent=20.0) == pytest.approx(2.0 / 3.0)
    assert gross_probability(2.0, [1.9], independent=1e6) == 1.0
    assert gross_probability(2.0, [], independent=10.0) == 0.0
    assert gross_probability(np.inf, [1.0], independent=1.0) == 1.0


def test_a_tilt_is_off_as_often_as_drawn_ones_are() -> None:
    """Of 400,000 draws of a bivariate t, four sigmas of their count; and the normal limit in closed form."""
    rng, degree = np.random.default_rng(4), np.radians(1.0)
    for freedom, spreads in ((5.0, (0.5, 0.5)), (12.0, (0.2, 0.6)), (12.0, (0.05, 0.5))):
        turn = np.array([[0.8, -0.6], [0.6, 0.8]])
        tilts = turn @ np.diag(np.radians(spreads) ** 2) @ turn.T
        drawn = rng.multivariate_normal(np.zeros(2), tilts, size=400_000)
        drawn /= np.sqrt(rng.chisquare(freedom, size=(400_000, 1)) / freedom)
        share = float((np.linalg.norm(drawn, axis=1) > degree).mean())
        within = 4.0 * np.sqrt(share * (1.0 - share) / 400_000)
        assert off_probability(tilts, freedom=freedom) == pytest.approx(share, abs=within)
    found = off_probability(np.eye(2) * np.radians(0.4) ** 2, freedom=1e9)
    assert found == pytest.approx(np.exp(-0.5 / 0.4**2), rel=1e-6)
    assert off_probability(np.zeros((2, 2)), freedom=12.0) == 0.0


def test_noise_counts_by_the_point_and_shape_by_the_sector() -> None:
    assert independent_errors(thickness=1.0, noise=1.0, points=5e4) == pytest.approx(5e4)
    assert independent_errors(thickness=1.0, noise=0.0, points=5e4) == 16.0
    # Satterthwaite's mean over the two: variances of a half each, of 320 and of 16 degrees of freedom
    mixed = independent_errors(thickness=np.sqrt(2.0), noise=1.0, points=320.0)
    assert mixed == pytest.approx(1.0 / (0.25 / 320.0 + 0.25 / 16.0))


def test_a_direction_known_too_badly_is_given_and_flagged() -> None:
    """A short arc of a drum under much noise tells its axis to half a degree: none is certain."""
    for seed in range(4):
        scan = revolution_scan("cylinder", arc_deg=60.0, sigma_mm=0.5, shape=(100, 50), seed=seed)
        axis = find_axis(scan.vertices_mm, scan.faces)
        assert axis.undetermined == ("direction to 1 deg",)
        assert 0.001 < axis.gross_probability < 0.5
        assert scan.angle_error_deg(axis.direction) < 4.0 * axis.sigma_deg < 4.0


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


@pytest.mark.study
def test_fluted_vases_do_not_bluff() -> None:
    """Most views fit other axes as well: 73 to 90 degrees off, with a sigma of 0.3 to 3 degrees."""
    refused = 0
    for seed, view in enumerate(np.random.default_rng(3).normal(size=(24, 3))):
        vertices, faces = fluted(7 + seed % 5, 0.06)
        points, triangles = single_view(vertices, faces, view, pixels=160, sigma=0.1, seed=seed)
        axis = find_axis(points, triangles, most_doubt=1.0)
        off_deg = axis_angle_deg(axis.direction, np.eye(3)[2])
        if off_deg > max(1.0, 5.0 * axis.sigma_deg):
            assert axis.gross_probability > 0.001
            with pytest.raises(InputError, match=r"another one: .* through .*, but also .* through"):
                find_axis(points, triangles)
            refused += 1
    assert refused > 12


def test_a_clean_wheel_is_not_doubted() -> None:
    for seed in range(4):
        scan = revolution_scan(sigma_mm=0.2, shape=(200, 80), seed=seed)
        assert find_axis(scan.vertices_mm, scan.faces).gross_probability < 1e-6
