"""The stated uncertainty of an axis against statistics that are known."""

import numpy as np
from scipy.stats import t as student

from bench.synthetic.axis_bound import cramer_rao_deg
from bench.synthetic.revolution import revolution_scan
from burrscan.axis import find_axis
from burrscan.axis.fitting.covariance import _add_centred, _freedom, _quantile_ratio, _tally, _widening
from burrscan.axis.fitting.fit import curve_of, meridian, off_piece, piece_of, refine


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


def test_scores_of_a_sector_are_about_the_means_of_the_parallel() -> None:
    """Running sums against Σ w (d - d̄) (J - J̄) and Σ w (J - J̄) (J - J̄)ᵀ of the points themselves."""
    rng = np.random.default_rng(5)
    w, d, J = rng.uniform(0.5, 2.0, 90), rng.normal(1.0, 1.0, 90), rng.normal(2.0, 1.0, (90, 4))
    sector = rng.integers(0, 64, 90)
    scores = np.zeros((64, 11))
    rows = np.column_stack([w, w * d, w[:, None] * J, (w * d)[:, None] * J, w * d * d])
    np.add.at(scores, sector, rows)
    total = scores.sum(axis=0)
    sums, shares = np.zeros((64, 4)), np.zeros((64, 4, 4))
    _add_centred(scores, total / total[0], sums, shares)
    off, lean = d - np.average(d, weights=w), J - np.average(J, axis=0, weights=w)
    expected, squares = np.zeros((64, 4)), np.zeros((64, 4, 4))
    np.add.at(expected, sector, (w * off)[:, None] * lean)
    # of a sector only its mean lean is known: it stands for its points
    for s in np.unique(sector):
        mine = sector == s
        mean = np.average(lean[mine], axis=0, weights=w[mine])
        squares[s] = w[mine].sum() * np.outer(mean, mean)
    np.testing.assert_allclose(sums, expected, atol=1e-12)
    np.testing.assert_allclose(shares, squares, atol=1e-12)


def test_the_slopes_variance_is_that_of_the_derivative_of_the_piece() -> None:
    """A piece is c0 + c1 t + c2 t²: its slope c1 + 2 c2 t has the variance (0, 1, 2t) Cov (0, 1, 2t)ᵀ."""
    scan = revolution_scan(shape=(120, 40), sigma_mm=0.2, seed=2)
    points = (scan.vertices_mm - scan.point_mm) / 90.0
    fit = refine(points, np.empty(0), scan.direction, np.zeros(3), blur=0.03, steps=2)
    curve, pieces = curve_of(fit), len(fit.coefficients)
    rng = np.random.default_rng(0)
    root = rng.normal(size=(pieces, 3, 3))
    gram = np.einsum("kij,klj->kil", root, root)
    slopes = np.zeros((pieces, 20))
    scores = np.zeros((pieces, 16, 64, 11))
    _tally(points, points, np.empty(0), fit.frame, fit.place, curve, 1e9, fit.response, gram, scores, slopes)
    expected = np.zeros(pieces)
    for i in range(len(points)):
        x, y, z = meridian(points, i, fit.frame, fit.place)
        k = piece_of(z, np.hypot(x, y), curve)
        if k >= 0:
            by = np.array([0.0, 1.0, 2.0 * off_piece(z, np.hypot(x, y), k, curve)[0]])
            expected[k] += by @ gram[k] @ by
    assert expected.max() > 100.0
    np.testing.assert_allclose(slopes[:, 5], expected, rtol=1e-9)
