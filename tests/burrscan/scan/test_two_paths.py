"""Direct light beside light that came by way of another surface: a strip mirrors what lies beside it."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy import optimize, sparse, stats

from burrscan.arrays import Bools
from burrscan.codes.code import patterns
from burrscan.scan.matching import two_paths
from burrscan.scan.matching.matched import Reading, read
from burrscan.scan.matching.two_paths import direct_of_two
from burrscan.scan.stripes import stripes
from tests.burrscan.instrument import Instrument, plane_depth, small_rig

CODE = stripes(11, width=128)
STRIP = slice(70, 90)
"""Columns of the camera that are a dark flank."""
DARK = 0.25
"""Its own brightness over the plane's."""


class Flank(Instrument):
    """An instrument whose strip sees ``share`` times its direct light from columns to its right.

    Their distances are gamma-distributed, sampled by scipy's quantiles, their rows normal.
    """

    def mirror(self, share: float, mean_px: float, spread: float, *, rows_px: float = 1.2) -> None:
        height, width = self.rig.projector.shape
        some, few = (np.arange(48) + 0.5) / 48, (np.arange(9) + 0.5) / 9
        away = stats.gamma.ppf(some, 1.0 / spread**2, scale=mean_px * spread**2)
        away, down = (one.ravel() for one in np.meshgrid(away, rows_px * stats.norm.ppf(few)))
        columns = np.zeros(self._shape, np.bool_)
        columns[:, STRIP] = True
        pixel = np.flatnonzero(columns.ravel() & np.isfinite(self.truth_u.ravel()))
        v = np.asarray(self._matrix @ np.repeat(np.arange(height), width)) / np.maximum(
            np.asarray(self._matrix.sum(axis=1)).ravel(), 1e-12
        )
        u = self.truth_u.ravel()[pixel, None] + away
        place = np.rint(np.clip(v[pixel, None] + down, 0, height - 1)).astype(int)
        low = np.floor(np.clip(u, 0, width - 2)).astype(int)
        part = np.clip(u, 0, width - 2) - low
        light = DARK * share * self.response.ravel()[pixel, None] / len(away)
        scale = np.ones(self.response.size)
        scale[pixel] = DARK
        beside = [
            sparse.coo_matrix(
                ((light * one).ravel(), (np.repeat(pixel, len(away)), (place * width + low + k).ravel())),
                self._matrix.shape,
            )
            for k, one in enumerate((1.0 - part, part))
        ]
        self._matrix = (sparse.diags(scale) @ self._matrix + beside[0] + beside[1]).tocsr()


@cache
def readings(share: float, mean_px: float, spread: float) -> tuple[Instrument, Reading, Reading]:
    """The instrument, what one path tells, and what two do."""
    rig = small_rig(width=160)
    instrument = Flank(rig, depth=plane_depth, decades=0.0, peak_e_per_ms=800.0, seed=4)
    instrument.mirror(share, mean_px, spread)
    shown = patterns(
        CODE.frames(rig.projector.shape), CODE.names, view=rig.projector, sheet=instrument.projector
    )
    images = instrument.capture(shown, 10.0)
    dark = np.full(images.shape[1:], 10.0 * instrument.ambient_e_per_ms, np.float32)
    one = read(images, CODE, camera=instrument.camera, rig=rig, dark_e=dark)
    return instrument, one, direct_of_two(images, CODE, one, camera=instrument.camera, rig=rig)


def strip(found: Reading) -> Bools:
    """Pixels of it whose mirrored light comes from within the projector's picture."""
    inside = np.zeros(found.u_px.shape, np.bool_)
    inside[10:-10, STRIP] = True
    return inside & np.isfinite(found.u_px)


@pytest.mark.parametrize(("share", "mean_px", "spread"), [(2.0, 6.0, 0.5), (1.0, 4.0, 0.8), (4.0, 8.0, 0.4)])
def test_the_direct_column_is_told_where_most_light_is_mirrored(
    share: float, mean_px: float, spread: float
) -> None:
    instrument, one, two = readings(share, mean_px, spread)
    off = two.u_px - instrument.truth_u
    changed = strip(two) & (two.u_px != one.u_px)
    assert np.count_nonzero(changed) > 0.6 * np.count_nonzero(strip(two))
    before = np.abs(one.u_px - instrument.truth_u)[changed]
    assert np.median(np.abs(off[changed])) < min(0.6 * np.median(before), 0.1)
    z = off[changed] / two.sigma_u_px[changed]
    assert np.mean(np.abs(z) > 4.0) < 0.02
    assert (two.lost[changed] <= 0.3).all()


def test_light_from_beside_the_direct_column_is_held_open() -> None:
    """Of an exponential as far away, what lies within a quarter stripe, as if all of it were midway there."""
    share, mean_px = 1.0, 4.0
    _, one, two = readings(share, mean_px, 0.8)
    near = share * stats.expon.cdf(1.5, scale=mean_px)
    changed = strip(two) & (two.u_px != one.u_px)
    assert np.median(two.sigma_u_px[changed]) > 0.8 * 0.75 * near / (1.0 + near)


def test_a_lone_path_is_left_alone_to_the_last_bit() -> None:
    _, one, two = readings(2.0, 6.0, 0.5)
    beside = np.ones(one.u_px.shape, np.bool_)
    beside[:, STRIP.start - 1 : STRIP.stop + 1] = False
    for name in ("u_px", "v_px", "sigma_u_px", "misfit", "lost"):
        np.testing.assert_array_equal(getattr(one, name)[beside], getattr(two, name)[beside])


def test_two_places_that_a_pixel_sees_are_no_two_paths(monkeypatch: pytest.MonkeyPatch) -> None:
    """Within what lies between neighbours' columns both may be direct: at a limb, at a step."""
    _, one, two = readings(1.0, 4.0, 0.8)
    told = np.count_nonzero(two.u_px[strip(two)] != one.u_px[strip(two)])
    monkeypatch.setattr(two_paths, "_steps", lambda u_px: np.full_like(u_px, 3.0))
    readings.cache_clear()
    _, one, two = readings(1.0, 4.0, 0.8)
    wide = np.count_nonzero(two.u_px[strip(two)] != one.u_px[strip(two)])
    readings.cache_clear()
    assert wide < 0.5 * told


def test_two_sharp_paths_are_no_broad_one_from_between_them() -> None:
    """Columns 14 px apart, as at a step: much light of all columns explains them half as badly as one."""
    instrument, one, two = readings(1.5, 14.0, 0.1)
    changed = strip(two) & (two.u_px != one.u_px)
    wrong = changed & (np.abs(two.u_px - instrument.truth_u) > 1.0)
    assert np.count_nonzero(wrong) < 0.01 * np.count_nonzero(strip(two))


F, G = 2.0 * np.pi * CODE.per_column, 2.0 * np.pi * CODE.per_row
SHARP = np.exp(-0.15 * (F * F + G * G))


def spread(frequency: float, down: float, apart: float, breadth: float) -> complex:
    return complex(two_paths._spread(two_paths._log_of(frequency, apart, breadth), down, breadth))


def model(place: float, apart: float, breadth: float) -> np.ndarray:
    """(K, 2) phasors of both paths' light of one unit."""
    other = [spread(f, g, apart, breadth) for f, g in zip(F, G, strict=True)]
    phasors: np.ndarray = np.exp(1j * F * place)[:, None] * np.stack([SHARP + 0j, other], axis=1)
    return phasors


def least_squares(t: np.ndarray, weight: np.ndarray, paths: np.ndarray) -> tuple[np.ndarray, float]:
    """Amplitudes from zero up and chi², by scipy's active sets."""
    root = np.sqrt(weight)
    A = np.concatenate([root[:, None] * paths.real, root[:, None] * paths.imag])
    both, residual = optimize.nnls(A, np.concatenate([root * t.real, root * t.imag]))
    return both, residual**2


@pytest.mark.parametrize("amplitudes", [(1.2, 0.8), (1.0, -0.4), (-0.3, 1.0)])
def test_amplitudes_and_gradient_are_those_of_least_squares(amplitudes: tuple[float, float]) -> None:
    rng = np.random.default_rng(2)
    t = model(0.7, -4.0, 0.5) @ amplitudes + 0.05 * (rng.normal(size=11) + 1j * rng.normal(size=11))
    weight = rng.uniform(0.5, 2.0, 11)
    p = np.array([0.4, -3.0, 0.6, 7.0, 7.0])

    def chi2_at(one: np.ndarray) -> float:
        return float(least_squares(t, weight, model(*one[:3]))[1] + (one[1] / two_paths._FAR_PX) ** 2)

    chi2, gradient, _ = two_paths._equations(p, t, weight, F, G, SHARP)
    np.testing.assert_allclose(p[3:], least_squares(t, weight, model(*p[:3]))[0], atol=1e-5)
    assert chi2 == pytest.approx(chi2_at(p), rel=1e-4)
    numeric = [(chi2_at(p + step) - chi2_at(p - step)) / 2e-5 for step in 1e-5 * np.eye(5)[:3]]
    np.testing.assert_allclose(-2.0 * gradient[:3], numeric, rtol=1e-3, atol=1e-3)


@pytest.mark.parametrize(
    ("breadths", "shares"),
    [
        pytest.param((0.3, 0.8), (0.4, 3.0), id="within"),
        pytest.param((1.0, 1.3), (5.0, 50.0), id="at a bound"),
    ],
)
def test_the_fit_ends_where_chi_squared_is_least(
    breadths: tuple[float, float], shares: tuple[float, float]
) -> None:
    """Where a simplex that knows nothing of derivatives ends, which begins at the truth."""
    rng, count = np.random.default_rng(3), 60
    weight = np.full((count, 11), 1.0 / 0.03**2)
    t, least = np.empty((count, 11), np.complex128), np.empty(count)
    for n in range(count):
        truth = (
            rng.uniform(-1.0, 1.0),
            rng.choice([-1.0, 1.0]) * rng.uniform(2.5, 9.0),
            rng.uniform(*breadths),
        )
        noise = 0.03 * (rng.normal(size=11) + 1j * rng.normal(size=11))
        t[n] = model(*truth) @ (1.0, rng.uniform(*shares)) + noise

        def chi2_at(one: np.ndarray, n: int = n) -> float:
            breadth = np.clip(one[2], two_paths._NARROWEST, two_paths._BROADEST)
            chi2 = least_squares(t[n], weight[n], model(one[0], one[1], breadth))[1]
            return float(chi2 + (one[1] / two_paths._FAR_PX) ** 2)

        least[n] = optimize.minimize(chi2_at, truth, method="Nelder-Mead", options={"xatol": 1e-5}).fun
    above = two_paths._both(t, weight, np.zeros(count), F, G)[:, 3] - least
    assert np.mean(above < 0.05) >= 0.95


def test_spread_light_has_the_phasor_of_its_distribution() -> None:
    f = np.linspace(0.3, 1.0, 9)
    away = np.linspace(0.0, 60.0, 600_001)
    density = stats.gamma.pdf(away, 4.0, scale=1.5)  # mean 6, relative spread a half
    true = np.array([np.trapezoid(density * np.exp(1j * one * away), away) for one in f])
    for apart, phasors in ((6.0, true), (-6.0, true.conj())):
        told = [spread(one, 0.0, apart, 0.5) for one in f]
        np.testing.assert_allclose(told, phasors, atol=1e-5)
