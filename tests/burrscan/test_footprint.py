"""Columns at the centroid of a footprint's light and at its centre, against sums over the footprint."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from burrscan.arrays import Floats
from burrscan.correspondence import Correspondence
from burrscan.footprint import at_centres, centroids
from burrscan.rig import Rig
from burrscan.triangulation import camera_rays, triangulate
from tests.burrscan.instrument import plane_depth, small_rig

_FINE = 1000


def seen(light: Callable[[Floats], Floats]) -> tuple[Floats, float]:
    """(5,) light of the pixels around -2 to 2, and where the middle one's centroid is, by summing."""
    x = (np.arange(5 * _FINE) + 0.5) / _FINE - 2.5
    each = light(x).reshape(5, _FINE)
    return each.mean(axis=1), float((x.reshape(5, _FINE)[2] * each[2]).sum() / each[2].sum())


def found(pixels: Floats, direction: int) -> tuple[float, float]:
    """Centroid and sigma of the middle pixel of an image that shows the pixels along one direction."""
    image = np.broadcast_to(pixels, (3, len(pixels))).copy()
    middle = (1, len(pixels) // 2)
    at = middle[::-1] if direction == 0 else middle
    centroid, sigma = centroids(image.T if direction == 0 else image, direction)
    return float(centroid[at]), float(sigma[at])


@pytest.mark.parametrize("direction", [0, 1])
@pytest.mark.parametrize("rate", [-2.3, -0.6, -0.02, 0.1, 0.7, 1.6])
def test_light_that_falls_exponentially_has_its_own_centroid(direction: int, rate: float) -> None:
    pixels, truth = seen(lambda x: np.exp(rate * x))
    centroid, sigma = found(pixels, direction)
    assert centroid == pytest.approx(truth, abs=2e-6)
    assert sigma < 0.1
    assert np.sign(centroid) == np.sign(rate)


@pytest.mark.parametrize("slope", [-0.3, -0.1, 0.02, 0.35])
def test_a_ramp_is_within_its_sigma(slope: float) -> None:
    pixels, truth = seen(lambda x: 1.0 + slope * x)
    centroid, sigma = found(pixels, 1)
    assert abs(centroid - truth) < sigma
    assert sigma < 0.7 * abs(truth)


@pytest.mark.parametrize("sharpness", [0.3, 0.6])
@pytest.mark.parametrize("off", [-3.0, -1.7, 0.0, 1.2, 2.5])
def test_the_flank_of_a_highlight_is_within_two_sigma(sharpness: float, off: float) -> None:
    """A lobe is no exponential; its rate changes from pixel to pixel."""
    pixels, truth = seen(lambda x: np.exp(-0.5 * (sharpness * (x - off)) ** 2))
    centroid, sigma = found(pixels, 1)
    assert abs(centroid - truth) < 2.0 * sigma + 1e-3
    assert sigma < 0.06


@pytest.mark.parametrize("direction", [0, 1])
@pytest.mark.parametrize("ratio", [0.2, 0.7, 1.5, 5.0])
@pytest.mark.parametrize("at", [-0.45, -0.2, 0.0, 0.1, 0.3, 0.49])
def test_a_step_is_one_end_of_the_interval(direction: int, ratio: float, at: float) -> None:
    pixels, truth = seen(lambda x: np.where(x < at, 1.0, ratio))
    centroid, sigma = found(pixels, direction)
    assert min(abs(centroid - sigma - truth), abs(centroid + sigma - truth)) < 2e-3
    # the other end is an exponential through the same neighbours
    rate = 0.5 * np.log(ratio)
    fall = 0.5 / np.tanh(0.5 * rate) - 1.0 / rate
    assert min(abs(centroid - sigma - fall), abs(centroid + sigma - fall)) < 2e-3


@pytest.mark.parametrize("direction", [0, 1])
@pytest.mark.parametrize("share", [0.3, 0.9])
def test_a_glint_narrower_than_a_pixel_may_lie_anywhere_in_it(direction: int, share: float) -> None:
    image = np.ones((9, 9))
    line = (slice(None), 4) if direction else (4, slice(None))
    image[line] = 1.0 / (1.0 - share)
    centroid, sigma = (each[line] for each in centroids(image, direction))
    assert centroid == pytest.approx(0.0, abs=1e-6)
    assert sigma == pytest.approx(0.2 * (share - 0.1), rel=1e-6)
    assert 2.0 * sigma.max() < 0.5 * share < 4.0 * sigma.max()  # as far aside as it can lie
    across = centroids(image, 1 - direction)[1]
    assert across == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("direction", [0, 1])
@pytest.mark.parametrize("dark", [0.0, 0.1])
@pytest.mark.parametrize(("first", "last"), [(-0.1, 1.1), (-0.2, 1.1), (-0.2, 1.2)])
def test_beside_a_gap_of_a_pixel_or_two_light_comes_from_the_far_side_of_it(
    direction: int, dark: float, first: float, last: float
) -> None:
    """A shadow between a floor and a flank half as bright again: its pixels know not how dark it is."""
    for floor, flank, way in ((1.0, 1.5, 1), (1.5, 1.0, 1), (1.0, 1.5, -1)):
        x = (np.arange(9 * _FINE) + 0.5) / _FINE - 4.5
        light = np.where(x < first, floor, np.where(x < last, dark, flank)).reshape(9, _FINE)
        truth = (x.reshape(9, _FINE) - np.arange(-4, 5)[:, None]) * light
        image = np.broadcast_to(light.mean(axis=1)[::way], (3, 9)).copy()
        moved, sigma = centroids(image.T if direction == 0 else image, direction)
        moved, sigma = (each.T if direction == 0 else each for each in (moved, sigma))
        for pixel in (4, 5):  # those that the gap's ends are in
            true = truth[pixel].sum() / light[pixel].sum()
            off = way * moved[1, ::way][pixel] - true
            assert abs(off) < 0.75 * abs(true)
            assert abs(off) < 1.5 * sigma[1, ::way][pixel]


def test_what_varies_by_a_quarter_from_pixel_to_pixel_has_no_gaps() -> None:
    """Turned metal: what its pixels lack of their neighbours' light is its own."""
    light = 1.0 + 0.25 * np.cos(np.pi * np.arange(40))
    assert np.abs(centroids(np.broadcast_to(light, (3, 40)).copy(), 1)[1][1, 3:-3]).max() < 0.1


def test_across_the_gradient_nothing_moves() -> None:
    image = np.broadcast_to(np.array([1.0, 2.0, 3.0]), (3, 3))
    centroid, sigma = centroids(image, 0)
    assert (centroid[1], sigma[1]) == (pytest.approx(0.0), pytest.approx(0.0))


_NOISE_PX = 0.02
_SPOTS = (np.arange(12) + 0.5) / 12 - 0.5


def beyond(pixels: Floats, rig: Rig, slant_deg: float) -> Floats:
    """Pixels by which places lie beyond a line through the middle of the image, 0.23 pixels off it."""
    turn = np.radians(slant_deg)
    x, y = pixels[..., 0] - rig.camera.cx, pixels[..., 1] - rig.camera.cy
    return np.asarray(x * np.cos(turn) + y * np.sin(turn) - 0.23)


def painted(rig: Rig, slant_deg: float, ratio: float = 5.0) -> tuple[Correspondence, Floats]:
    """A plane, bright beyond a slanted line: columns at centroids, and radiance."""
    grid = rig.camera.pixel_grid()
    light, column = np.zeros(grid.shape[:2]), np.zeros(grid.shape[:2])
    for dx in _SPOTS:
        for dy in _SPOTS:
            rays = rig.camera.rays(grid + np.array([dx, dy]))
            u = rig.correspond(rays * plane_depth(rays)[..., None])[..., 0]
            bright = np.where(beyond(grid + np.array([dx, dy]), rig, slant_deg) > 0.0, ratio, 1.0)
            light += bright
            column += bright * u
    u_px = (column / light).astype(np.float32)
    sigma = np.full(u_px.shape, _NOISE_PX, np.float32)
    return Correspondence(u_px, sigma, np.ones(u_px.shape, bool)), light


@pytest.mark.parametrize(
    ("slant_deg", "worse", "left"),
    # a line that runs nearly along the rows moves the columns little, and half of that little is left
    [(0.0, 3.0, 0.5), (17.0, 3.0, 0.5), (45.0, 3.0, 0.5), (-70.0, 1.5, 0.55)],
)
def test_a_painted_step_on_a_plane_loses_half_of_its_bias(
    slant_deg: float, worse: float, left: float
) -> None:
    rig = small_rig(width=120)
    correspondence, light = painted(rig, slant_deg)
    truth = plane_depth(camera_rays(rig.camera))
    corrected = at_centres(correspondence, light.astype(np.float32))
    before, after = (triangulate(one, rig)[0][..., 2] for one in (correspondence, corrected))
    crossed = np.zeros(truth.shape, bool)
    reach = 0.5 * (abs(np.cos(np.radians(slant_deg))) + abs(np.sin(np.radians(slant_deg))))
    crossed[1:-1, 1:-1] = (np.abs(beyond(rig.camera.pixel_grid(), rig, slant_deg)) < reach)[1:-1, 1:-1]
    bias, rest = (np.abs(depth - truth)[crossed] for depth in (before, after))
    assert crossed.sum() > 50
    assert np.sqrt((rest**2).mean()) < left * np.sqrt((bias**2).mean())
    # with the noise of a good scan: sigma covers what is left, which it does not without the correction
    noisy = replace(
        correspondence,
        u_px=correspondence.u_px
        + np.random.default_rng(5).normal(0.0, _NOISE_PX, light.shape).astype(np.float32),
    )
    pulls = []
    for one in (noisy, at_centres(noisy, light.astype(np.float32))):
        points, sigma = triangulate(one, rig)
        pulls.append(
            ((points[..., 2] - truth) * np.linalg.norm(camera_rays(rig.camera), axis=-1) / sigma)[crossed]
        )
    assert np.sqrt((pulls[0] ** 2).mean()) > worse
    assert np.sqrt((pulls[1] ** 2).mean()) < 1.3
    assert np.abs(pulls[1]).max() < 5.0


def flat(shape: tuple[int, int] = (9, 12)) -> Correspondence:
    """Columns that rise by 0.7 to the right and by 0.1 down."""
    row, column = np.mgrid[: shape[0], : shape[1]]
    u_px = (0.7 * column + 0.1 * row).astype(np.float32)
    return Correspondence(u_px, np.full(shape, 0.01, np.float32), np.ones(shape, bool))


def glow(shape: tuple[int, int] = (9, 12)) -> Floats:
    row, column = np.mgrid[: shape[0], : shape[1]]
    return np.asarray(np.exp(0.2 * column - 0.1 * row))


def test_even_light_moves_nothing() -> None:
    found = at_centres(flat(), np.full((9, 12), 37.0, np.float32))
    np.testing.assert_array_equal(found.u_px, flat().u_px)
    np.testing.assert_array_equal(found.sigma_u_px, flat().sigma_u_px)


def test_without_radiance_it_is_the_same_object() -> None:
    correspondence = flat()
    assert at_centres(correspondence, None) is correspondence


@pytest.mark.parametrize("factor", [1e-6, 3.7, 1e9])
def test_the_unit_of_the_radiance_does_not_matter(factor: float) -> None:
    one, other = (at_centres(flat(), (k * glow()).astype(np.float32)) for k in (1.0, factor))
    assert np.abs(one.u_px - flat().u_px).max() > 0.01
    np.testing.assert_allclose(other.u_px, one.u_px, atol=2e-6)
    np.testing.assert_allclose(other.sigma_u_px, one.sigma_u_px, atol=2e-6)


def test_beside_missing_columns_and_jumps_one_side_tells_the_slope() -> None:
    whole = at_centres(flat(), glow().astype(np.float32)).u_px
    for beyond in (np.nan, 50.0):
        cut = flat().u_px.copy()
        cut[:, 6:] += np.float32(beyond)
        found = at_centres(
            Correspondence(cut, flat().sigma_u_px, np.isfinite(cut)), glow().astype(np.float32)
        )
        np.testing.assert_allclose(found.u_px[:, :6], whole[:, :6], atol=1e-6)
        np.testing.assert_allclose(found.u_px[:, 6:], whole[:, 6:] + beyond, atol=1e-5)


def test_beside_unknown_light_nothing_moves_that_way() -> None:
    light = glow().astype(np.float32)
    light[4, 5] = np.nan
    plain, found = at_centres(flat(), glow().astype(np.float32)), at_centres(flat(), light)
    assert np.isfinite(found.u_px).all()
    assert found.u_px[4, 5] == flat().u_px[4, 5]
    # its right neighbour moves by what is above and below alone
    column = centroids(glow(), 1)[0]
    assert found.u_px[4, 6] == pytest.approx(plain.u_px[4, 6] + 0.7 * column[4, 6], abs=1e-5)
