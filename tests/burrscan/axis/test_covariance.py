"""The stated uncertainty of an axis against statistics that are known."""

import numpy as np
from scipy.stats import t as student

from bench.synthetic.axis_bound import cramer_rao_deg
from bench.synthetic.revolution import revolution_scan
from burrscan.axis import find_axis
from burrscan.axis.fitting.covariance import _freedom, _quantile_ratio, _widening


def test_short_arcs_do_not_feign_information() -> None:
    """Steps within a piece made 1.4 times the information of it that there is: 0.85 of the bound."""
    stated = []
    for seed in range(4):
        scan = revolution_scan(arc_deg=60.0, sigma_mm=1.0, seed=seed)
        stated.append(find_axis(scan.vertices_mm, scan.faces).sigma_deg)
    assert 0.93 < np.mean(stated) / cramer_rao_deg(arc_deg=60.0, sigma_mm=1.0) < 1.25


def test_widening_is_the_true_variance_over_the_stated() -> None:
    """Monte Carlo: sectors of a linear fit whose noise has nine times the variance that is stated."""
    rng = np.random.default_rng(0)
    ratios = []
    for _ in range(400):
        design = rng.normal(size=(600, 4)) * np.linspace(0.2, 2.0, 600)[:, None]  # sectors of unequal weight
        basis = np.linalg.qr(design)[0]
        noise = 3.0 * rng.normal(size=600)
        scores = basis * (noise - basis @ (basis.T @ noise))[:, None]
        sums = scores.reshape(12, 50, 4).sum(axis=1)
        shares = np.einsum("snp,snq->spq", *[basis.reshape(12, 50, 4)] * 2)
        ratios.append(_widening(sums, shares, 1.0))
    error = np.std(ratios) / np.sqrt(len(ratios))
    assert abs(np.mean(ratios) - 9.0) < 4.0 * error


def test_noise_that_is_alike_within_sectors_widens() -> None:
    basis = np.linalg.qr(np.random.default_rng(1).normal(size=(12, 4)))[0]
    shares = np.einsum("sp,sq->spq", basis, basis)
    assert _widening(np.zeros((12, 4)), shares, 1.0) == 1.0
    assert _widening(10.0 * basis, shares, 1.0) > 30.0


def test_freedom_is_that_of_the_widening_over_many_draws() -> None:
    """Monte Carlo: a variance with n degrees of freedom has a squared relative spread of 2 / n."""
    rng = np.random.default_rng(2)
    design = rng.normal(size=(20, 4)) * np.linspace(0.5, 1.5, 20)[:, None]  # one row stands for a sector
    basis = np.linalg.qr(design)[0]
    shares = np.einsum("sp,sq->spq", basis, basis)
    ratios = []
    for _ in range(4000):
        noise = 10.0 * rng.normal(size=20)
        ratios.append(_widening(basis * (noise - basis @ (basis.T @ noise))[:, None], shares, 1.0))
    spread = 2.0 * np.mean(ratios) ** 2 / np.var(ratios)
    assert abs(_freedom(shares) / spread - 1.0) < 0.15


def test_intervals_are_students_where_sectors_alone_tell() -> None:
    for freedom in (5.0, 8.0, 30.0):
        exact = student.ppf(0.975, freedom) / student.ppf(0.975, np.inf)
        assert abs(_quantile_ratio(1e9, freedom) / exact - 1.0) < 0.02
    assert _quantile_ratio(1.0, 3.0) == 1.0
