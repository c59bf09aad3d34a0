"""Ridges and nicks as a camera's pixels see them, against rays that are followed until they meet them."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from burrscan.arrays import Floats
from burrscan.burrs import describe
from burrscan.burrs.describe import Eye, Site
from burrscan.burrs.shape.patch import Patch
from burrscan.burrs.shape.ridge import Ridge, _equations, _of_height, _profile, first_ridge, fit_ridge
from burrscan.burrs.shape.section import Kind

PIXEL = 0.5
FINE = 40
"""Rays to a pixel."""


def height_at(x: Floats, height: float, half: float, kind: Kind) -> Floats:
    """The cross-section itself, x from its middle."""
    q = np.abs(x) / half
    if kind.power == 2:
        return np.asarray(height * np.clip(1.0 - q * q, 0.0, None))
    return np.asarray(np.minimum(height / (1.0 - kind.blunt) * np.clip(1.0 - q, 0.0, None), height))


def seen(places: Floats, height: float, half: float, kind: Kind, *, slant: float, sunk: bool) -> Floats:
    """Mean lift over each pixel: rays at v = s + slant · lift, followed in from outside of the metal."""
    rays = (places[:, None] + PIXEL * ((np.arange(FINE) + 0.5) / FINE - 0.5)).ravel()
    lift = np.linspace(0.0, height, 801)
    met = height_at(rays[:, None] + slant * lift, height, half, kind)
    if sunk:  # from the surface down: the first depth at which there is metal
        first = np.argmax(met <= lift + 1e-9, axis=1)
    else:  # from above: the highest place on the ray that is metal
        first = len(lift) - 1 - np.argmax((met >= lift - 1e-9)[:, ::-1], axis=1)
    return np.asarray(lift[first].reshape(len(places), FINE).mean(axis=1))


@pytest.mark.parametrize("sunk", [False, True])
@pytest.mark.parametrize("slant", [0.0, 0.5, -0.9, 1.8])
@pytest.mark.parametrize("kind", [Kind(1, PIXEL), Kind(1, PIXEL, 0.4)])
def test_what_pixels_see_is_what_rays_meet(kind: Kind, slant: float, *, sunk: bool) -> None:
    height, half = 1.2, 1.0
    s = np.linspace(-4.0, 4.0, 161)
    patch = Patch(np.zeros_like(s), s, s, s, slant=slant, pixel_mm=PIXEL, sunk=sunk)
    found = height * _profile(patch, np.array([height, 0.0, 0.0, half, 0.0]), kind)[0]
    true = seen(s, height, half, kind, slant=slant, sunk=sunk)
    np.testing.assert_allclose(found, true, atol=0.04 * height)  # a flank that is hidden is a step
    assert np.sqrt(np.mean((found - true) ** 2)) < 0.008 * height


@pytest.mark.parametrize("kind", [Kind(1, PIXEL), Kind(2, PIXEL), Kind(1, PIXEL, 0.4)])
@pytest.mark.parametrize(("slant", "sunk"), [(0.4, False), (-0.6, False), (0.5, True)])
def test_the_gradient_is_that_of_chi_squared(kind: Kind, slant: float, *, sunk: bool) -> None:
    rng = np.random.default_rng(4)
    u, v = rng.uniform(-5.0, 5.0, 300), rng.uniform(-2.0, 2.0, 300)
    lift, sigma = rng.normal(0.3, 0.3, 300), rng.uniform(0.1, 0.3, 300)
    patch = Patch(u, v, lift, sigma, slant=slant, pixel_mm=PIXEL, sunk=sunk)
    p = np.array([0.8, 0.1, 0.15, 1.1, -0.2])

    def chi2_at(one: np.ndarray) -> float:
        return float(_equations(patch, one, kind)[0])

    numeric = [(chi2_at(p + step) - chi2_at(p - step)) / 2e-6 for step in 1e-6 * np.eye(5)]
    np.testing.assert_allclose(-2.0 * _equations(patch, p, kind)[1], numeric, rtol=1e-4, atol=2e-3)


def fitted(height: float, half: float, slant: float, *, sunk: bool, kind: Kind, known: bool = True) -> Ridge:
    """A burr 20 mm long, a little askew to the pixels; ``known`` is from where it was seen."""
    rng = np.random.default_rng(7)
    rows = np.arange(-10.0, 10.0, PIXEL)
    columns = PIXEL * np.arange(-12, 13)
    s = (columns[None, :] + 0.013 * rows[:, None] + 0.21).ravel()
    u = np.repeat(rows, len(columns))
    lift = seen(s, height, half, kind, slant=slant, sunk=sunk) + rng.normal(0.0, 0.005, len(s))
    v = s if known else s + slant * lift
    patch = Patch(u, v, lift, np.full(len(u), 0.02))
    if known:
        patch = Patch(u, v, lift, patch.sigma_mm, slant=slant, pixel_mm=PIXEL, sunk=sunk)
    first = first_ridge(patch, spacing_mm=PIXEL, start=(-10.0, 10.0))
    assert first is not None
    return fit_ridge(patch, first, spacing_mm=PIXEL)


@pytest.mark.parametrize("sunk", [False, True])
@pytest.mark.parametrize("slant", [0.0, 0.35, -0.7, 1.2])
def test_a_burr_four_pixels_wide_is_as_high_as_it_is_from_wherever_it_is_seen(
    slant: float, *, sunk: bool
) -> None:
    ridge = fitted(1.0, 1.0, slant, sunk=sunk, kind=Kind())
    assert ridge.height_mm == pytest.approx(1.0, abs=max(0.05, 2.0 * ridge.open_mm))
    assert ridge.width_mm == pytest.approx(2.0, abs=0.2)
    assert ridge.parameters[1] == pytest.approx(0.0, abs=0.05)


def test_a_crest_that_is_round_is_no_higher_than_it_is() -> None:
    ridge = fitted(1.0, 1.2, 0.4, sunk=False, kind=Kind(2))
    assert ridge.height_mm == pytest.approx(1.0, abs=0.07)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("direction", [(0.0, 1.0), (1.0, 0.0), (0.6, 0.8)])
def test_vertices_go_where_their_lines_of_sight_meet_the_surface_below(
    direction: tuple[float, float], sign: int
) -> None:
    """A cylinder so large that it is its tangent plane, x outwards; from a camera to both sides of a burr."""
    radius, rng = 1e6, np.random.default_rng(5)
    around, along = rng.uniform(-3.0, 3.0, (2, 60))
    lift = rng.uniform(0.0, 2.0, 60)
    camera = np.array([radius + 500.0, 210.0, -160.0])
    field: Any = SimpleNamespace(
        angle=around / radius,
        foot=np.stack([along, np.full(60, radius)], axis=1),
        normal=np.tile([0.0, 1.0], (60, 1)),
    )
    a, b = direction
    patch = Patch(around * a + along * b, along * a - around * b, lift, np.ones(60))
    site = Site(np.arange(60), np.ones(60, np.bool_), sign, 20.0)
    found = describe._seen_by(Eye(camera, 1e-3), patch, field, site, np.array(direction))
    vertex = np.stack([radius + sign * lift, around, along], axis=1)
    met = camera + (vertex - camera) * ((camera[0] - radius) / (camera[0] - vertex[:, 0]))[:, None]
    np.testing.assert_allclose(found.v_mm, met[:, 2] * a - met[:, 1] * b, atol=0.01)
    np.testing.assert_allclose(found.as_points().v_mm, patch.v_mm, atol=0.02)
    assert found.sunk == (sign < 0)
    away = np.linalg.norm(camera - [radius, 0.0, 0.0])
    assert found.pixel_mm == pytest.approx(1e-3 * away * np.hypot(1.0, found.slant), rel=0.01)


def test_pixels_that_are_taken_for_points_tell_another_height() -> None:
    """What it is for: from aside a narrow ridge's near flank is in two pixels, its crest in the next."""
    as_points = fitted(1.0, 0.8, 0.9, sunk=False, kind=Kind(), known=False).height_mm
    as_pixels = fitted(1.0, 0.8, 0.9, sunk=False, kind=Kind()).height_mm
    assert as_points < 0.85
    assert as_pixels == pytest.approx(1.0, abs=0.02)


def test_of_fewer_than_three_pixels_both_count_and_what_they_differ_by_is_open() -> None:
    """A ridge and a nick of two pixels: the truth is within what is stated."""
    for sunk in (False, True):
        ridge = fitted(1.0, 0.5, 0.3, sunk=sunk, kind=Kind())
        assert abs(ridge.height_mm - 1.0) < 3.0 * np.hypot(ridge.open_mm, ridge.sigma_of([1, 0, 0, 0, 0]))
        assert ridge.open_mm > 0.1


def test_a_mean_height_is_as_sure_in_proportion_as_the_fit_that_stands_for_it() -> None:
    """Else a mean lower than the fit is not credible, and its burr is told by light alone, or lost."""
    ridge = fitted(1.0, 0.8, 0.3, sunk=False, kind=Kind())
    lower = _of_height(ridge, 0.3 * ridge.height_mm, 0.1)
    height, width = [1.0, 0, 0, 0, 0], [0, 0, 0, 2.0, 0]
    assert lower.sigma_of(height) == pytest.approx(0.3 * ridge.sigma_of(height))
    assert lower.noise_mm == pytest.approx(0.3 * ridge.noise_mm)
    assert lower.sigma_of(width) == pytest.approx(ridge.sigma_of(width))
    w, h = ridge.width_mm, ridge.height_mm
    assert lower.sigma_of([w, 0, 0, 0.6 * h, 0]) == pytest.approx(0.3 * ridge.sigma_of([w, 0, 0, 2.0 * h, 0]))
    sunk = replace(ridge, parameters=ridge.parameters * [-1.0, 1, 1, 1, 1])  # a fit that noise turned over
    none = _of_height(sunk, 1e-9, 0.0)
    assert none.height_mm < 2.0 * none.sigma_of(height)
    assert none.height_mm < none.noise_mm
