"""The stated uncertainty of an axis against statistics that are known."""

import numpy as np
import pytest

from bench.synthetic.axis_bound import cramer_rao_deg
from bench.synthetic.axis_table import within_95
from bench.synthetic.revolution import revolution_scan
from burrscan.axis import find_axis
from burrscan.axis.fitting.covariance import _condensed, _tally
from burrscan.axis.fitting.fit import curve_of, meridian, off_piece, piece_of, refine


def test_short_arcs_do_not_feign_information() -> None:
    """Steps within a piece made 1.4 times the information of it that there is: 0.85 of the bound."""
    stated = []
    for seed in range(4):
        scan = revolution_scan(arc_deg=60.0, sigma_mm=1.0, seed=seed)
        stated.append(find_axis(scan.vertices_mm, scan.faces).sigma_deg)
    assert 0.93 < np.mean(stated) / cramer_rao_deg(arc_deg=60.0, sigma_mm=1.0) < 1.25


@pytest.mark.study
def test_noise_is_not_taken_for_walls() -> None:
    """On a fine mesh with noise four fifths of the points passed for walls: 1.65 times the bound."""
    bound = cramer_rao_deg(arc_deg=60.0, sigma_mm=0.3)
    errors = []
    for seed in range(20):
        scan = revolution_scan(arc_deg=60.0, sigma_mm=0.3, seed=seed)
        errors.append(scan.angle_error_deg(find_axis(scan.vertices_mm, scan.faces).direction))
    # of 20 errors in two directions the rms is known to 0.11: three standard errors
    assert np.sqrt(np.mean(np.square(errors))) / bound < 1.35


def test_scores_of_a_sector_are_about_the_means_of_the_parallel() -> None:
    """Running sums against Σ w (d - d̄) (J - J̄) and Σ w (J - J̄) (J - J̄)ᵀ of the points themselves."""
    rng = np.random.default_rng(5)
    w, d, J = rng.uniform(0.5, 2.0, 90), rng.normal(1.0, 1.0, 90), rng.normal(2.0, 1.0, (90, 4))
    sector = rng.integers(0, 64, 90)
    scores = np.zeros((64, 11))
    rows = np.column_stack([w, w * d, w[:, None] * J, (w * d)[:, None] * J, w * d * d])
    np.add.at(scores, sector, rows)
    told = _condensed(scores[None, None], np.ones(1))
    off, lean = d - np.average(d, weights=w), J - np.average(J, axis=0, weights=w)
    expected, squares = np.zeros((64, 4)), np.zeros((64, 4, 4))
    np.add.at(expected, sector, (w * off)[:, None] * lean)
    # of a sector only its mean lean is known: it stands for its points
    for s in np.unique(sector):
        mine = sector == s
        mean = np.average(lean[mine], axis=0, weights=w[mine])
        squares[s] = w[mine].sum() * np.outer(mean, mean)
    lifted = np.zeros((64, 4))
    np.add.at(lifted, sector, w[:, None] * lean)
    np.testing.assert_allclose(told.lifts[0], lifted, atol=1e-12)
    np.testing.assert_allclose(told.weights, np.bincount(sector, w, 64), atol=1e-12)
    np.testing.assert_allclose(told.sums, expected, atol=1e-12)
    np.testing.assert_allclose(told.shares, squares, atol=1e-12)
    mean = np.average(J, axis=0, weights=w)
    np.testing.assert_allclose(told.known, w.sum() * np.outer(mean, mean), rtol=1e-12)
    assert told.squares == pytest.approx((w * off**2).sum())
    assert told.freedom == pytest.approx(w.sum() - 1.0)


def test_the_slopes_variance_is_that_of_the_derivative_of_the_piece() -> None:
    """A piece is c0 + c1 t + c2 t²: its slope c1 + 2 c2 t has the variance (0, 1, 2t) Cov (0, 1, 2t)ᵀ."""
    scan = revolution_scan(shape=(120, 40), sigma_mm=0.2, seed=2)
    points = (scan.vertices_mm - scan.point_mm) / 90.0
    fit = refine(points, np.empty(0), scan.direction, np.zeros(3), blur=0.03, steps=2)
    curve, pieces = curve_of(fit), len(fit.coefficients)
    rng = np.random.default_rng(0)
    root = rng.normal(size=(pieces, 3, 3))
    gram = np.einsum("kij,klj->kil", root, root)
    slopes = np.zeros((pieces, 2, 5, 5))
    scores = np.zeros((pieces, 16, 64, 11))
    _tally(
        points,
        points,
        np.empty(0),
        fit.frame,
        fit.place,
        curve,
        np.ones(pieces),
        1e9,
        fit.response,
        gram,
        scores,
        slopes,
    )
    expected = np.zeros(pieces)
    for i in range(len(points)):
        x, y, z = meridian(points, i, fit.frame, fit.place)
        k = piece_of(z, np.hypot(x, y), curve)
        if k >= 0:
            by = np.array([0.0, 1.0, 2.0 * off_piece(z, np.hypot(x, y), k, curve)[0]])
            expected[k] += by @ gram[k] @ by
    assert expected.max() > 100.0
    np.testing.assert_allclose(slopes[:, 1, 0, 0], expected, rtol=1e-9)


@pytest.mark.study
@pytest.mark.parametrize(
    "over", [pytest.param(1, marks=pytest.mark.study), 9, pytest.param(25, marks=pytest.mark.study)]
)
def test_intervals_hold_whatever_the_noises_length(over: int) -> None:
    """Running means over so many rows and columns; a covariance that ignores them holds in 20 to 40 %."""
    held = []
    for seed in range(30):
        scan = revolution_scan("vase", sigma_mm=0.1, seed=(seed, over), shape=(242, 64), correlated_over=over)
        held.append(within_95(find_axis(scan.vertices_mm, scan.faces), scan))
    # 30 scans of some two independent intervals each: 0.85 is 3.6 sigma of a binomial below 0.95
    assert np.mean(held) > 0.85


@pytest.mark.study
def test_correlation_is_not_made_up() -> None:
    """Where noise is independent the stated deviation stays within a fifth of the bound's, in the middle."""
    bound = cramer_rao_deg(sigma_mm=0.1, shape=(242, 64))
    stated = []
    for seed in range(12):
        scan = revolution_scan(sigma_mm=0.1, seed=seed, shape=(242, 64))
        stated.append(find_axis(scan.vertices_mm, scan.faces).sigma_deg)
    assert 0.9 < np.median(stated) / bound < 1.3
