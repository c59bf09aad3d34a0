import numpy as np
import pytest

from bench.synthetic.revolution import revolution_scan
from burrscan.axis.sections import (
    fit_circles,
    kasa_circle,
    ransac_rounds,
    sections,
    taubin_circle,
    turned_to_z,
)


@pytest.mark.parametrize(("percent", "rounds"), [(6, 3), (8, 4), (16, 6), (46, 28), (61, 73)])
def test_ransac_table_of_the_paper(percent: int, rounds: int) -> None:
    # The paper rounds its percentages: some share that rounds to the stated one gives the stated N.
    shares = np.linspace(percent - 0.5, percent + 0.5, 1001) / 100.0
    assert rounds in {int(np.ceil(ransac_rounds(share))) for share in shares}


def test_ransac_rounds_at_the_ends() -> None:
    assert ransac_rounds(0.0) == 0.0
    assert ransac_rounds(1.0) == np.inf


def test_turn_takes_the_orientation_to_z() -> None:
    theta, phi = 0.7, 2.1
    direction = np.array([np.cos(theta) * np.sin(phi), np.sin(theta) * np.sin(phi), np.cos(phi)])
    turn = turned_to_z(theta, phi)
    np.testing.assert_allclose(turn @ direction, [0, 0, 1], atol=1e-15)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-15)


@pytest.mark.parametrize("fit", [kasa_circle, taubin_circle])
def test_circles_through_exact_points(fit: object) -> None:
    angle = np.linspace(-0.3, 0.3, 50)
    assert callable(fit)
    np.testing.assert_allclose(
        fit(5.0 + 90.0 * np.cos(angle), -7.0 + 90.0 * np.sin(angle)), [5, -7, 90], rtol=1e-7
    )


def test_taubin_is_less_biased_than_kasa_on_a_short_noisy_arc() -> None:
    rng = np.random.default_rng(1)
    angle = np.linspace(-0.35, 0.35, 400)
    radii = []
    for _ in range(40):
        r = 90.0 + 0.5 * rng.normal(size=400)
        x, y = r * np.cos(angle), r * np.sin(angle)
        radii.append([kasa_circle(x, y)[2], taubin_circle(x, y)[2]])
    kasa, taubin = np.abs(np.mean(radii, axis=0) - 90.0)
    assert taubin < 0.5 * kasa


def test_layer_trick_finds_the_radii_of_a_cone() -> None:
    scan = revolution_scan("cone", shape=(300, 200))
    turn = np.ascontiguousarray(scan.T_mesh_part[:3, :3].T)
    points, index = sections(scan.vertices_mm, scan.faces, turn, planes=10)
    assert set(np.unique(index)) == set(range(1, 10))
    circles = fit_circles(points, index, 10, 1.0, 0, False, False, np.array([1], dtype=np.int64))
    origin = turn @ scan.point_mm
    z = np.arange(1, 10) * 6.0 - 30.0
    np.testing.assert_allclose(circles[1:10, 3], 85.0 + z / 2.0, atol=0.2)  # a triangle is 0.3 mm high
    np.testing.assert_allclose(circles[1:10, :2], np.tile(origin[:2], (9, 1)), atol=0.05)
