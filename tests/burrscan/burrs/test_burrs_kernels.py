"""Inner loops of the burr methods against formulas written out."""

from __future__ import annotations

import numpy as np
import pytest

from burrscan.burrs.noise.correlated_noise import _roughness
from burrscan.burrs.shape.patch import Patch
from burrscan.burrs.shape.ridge import _equations
from burrscan.burrs.shape.section import Kind


def test_the_difference_of_two_neighbours_is_in_units_of_both_their_noises() -> None:
    cell = np.array([0, 1, 0, 0])
    rough = _roughness(np.array([1.0, 9.0, -9.0, -4.0]), np.array([3.0, 1.0, 4.0, 12.0]), cell)
    # 10 over the root of 9 + 16; 5 over the root of 16 + 144; the first of a cell has nobody before it
    np.testing.assert_allclose(rough, [np.nan, np.nan, 2.0, 5.0 / np.sqrt(160.0)])


def test_a_slanted_ridge_fits_vertices_that_lie_on_it() -> None:
    """Height 1.5, crest at v = 0.4 + 0.3 u, half-widths 0.8 ∓ 0.2: chi² is nothing, and its slope, too."""
    rng = np.random.default_rng(3)
    u, v = rng.uniform(-5.0, 5.0, 400), rng.uniform(-3.0, 3.0, 400)
    across = v - 0.4 - 0.3 * u
    lift = 1.5 * np.clip(1.0 - np.abs(across) / np.where(across < 0.0, 0.6, 1.0), 0.0, None)
    p = np.array([1.5, 0.4, 0.3, 0.8, 0.25])
    chi2, gradient, _ = _equations(Patch(u, v, lift, np.full(400, 0.1)), p, Kind())
    assert chi2 < 1e-20
    np.testing.assert_allclose(gradient, 0.0, atol=1e-9)


@pytest.mark.parametrize("kind", [Kind(footprint_mm=0.3), Kind(power=2), Kind(blunt=0.4)])
def test_the_gradient_is_that_of_chi_squared(kind: Kind) -> None:
    rng = np.random.default_rng(4)
    u, v = rng.uniform(-5.0, 5.0, 300), rng.uniform(-2.0, 2.0, 300)
    lift, sigma = rng.normal(0.3, 0.3, 300), rng.uniform(0.1, 0.3, 300)
    p = np.array([0.8, 0.1, 0.15, 1.1, -0.2])

    def chi2_at(one: np.ndarray) -> float:
        return float(_equations(Patch(u, v, lift, sigma), one, kind)[0])

    steps = 1e-6 * np.eye(5)
    numeric = [(chi2_at(p + step) - chi2_at(p - step)) / 2e-6 for step in steps]
    gradient = _equations(Patch(u, v, lift, sigma), p, kind)[1]
    np.testing.assert_allclose(-2.0 * gradient, numeric, rtol=1e-4, atol=1e-3)
