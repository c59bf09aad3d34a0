"""Places where light and depth are both off, on a cylinder whose light and depth are formulas."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from burrscan.arrays import Floats
from burrscan.burrs.light.disturbed import Place, _is_a_glint, _measurable, disturbed
from burrscan.burrs.light.row_sigma import row_sigma
from burrscan.burrs.light.unrolled import Unrolled
from burrscan.inspection import Generatrix
from tests.burrscan.burrs.light.scene import HALF_LENGTH_MM, Scene, bright_line, dark_line
from tests.tiers import some_of

WIDEST_MM = 3.0
LEANING = [(0.0, 1.0, 0.0), (0.3, 1.0, 0.0), (0.0, 1.0, 0.2), (-0.2, 0.9, -0.2)]


def found(scene: Scene, *, unit: float = 1.0) -> tuple[Unrolled, list[Place]]:
    surface, _, places = disturbed(scene.sight(unit=unit), scene.axis, scene.generatrix, widest_mm=WIDEST_MM)
    return surface, places


@some_of("seed", range(20), first=6)
def test_a_clean_part_has_none(seed: int) -> None:
    scene = Scene(seed=seed)
    scene.lost |= (
        np.random.default_rng(seed).random(scene.on.shape) < 0.02
    )  # pixels that failed here and there
    surface, places = found(scene)
    assert surface.open.sum() > 10_000
    assert places == []


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("factor", [0.2, 5.0])
def test_a_stain_and_a_scratch_are_none(factor: float, seed: int) -> None:
    scene = Scene(seed=seed)
    stain = np.hypot(scene.around - 15.0, scene.along) < 6.0
    scratch = scene.band(-20.0, 1.5, -20.0, 25.0)
    scene.log_light[stain | scratch] += np.log(factor)
    assert found(scene)[1] == []


@pytest.mark.parametrize("seed", range(3))
def test_doubtful_depth_and_holes_alone_are_none(seed: int) -> None:
    scene = Scene(seed=seed)
    rng = np.random.default_rng(100 + seed)
    noisy, holes = scene.band(15.0, 5.0, -15.0, 15.0), scene.band(-20.0, 5.0, -15.0, 15.0)
    scene.lift_mm[noisy] += 1.0 * rng.normal(size=int(noisy.sum()))
    scene.lost |= holes
    assert found(scene)[1] == []


def test_the_noise_of_what_is_dark_is_none() -> None:
    """As on the dark sectors of an end face: the darker the noisier, a third of it without a depth."""
    calls = 0
    for seed in range(6):
        scene = Scene(seed=seed)
        rng = np.random.default_rng(90 + seed)
        noise, holes = (ndimage.gaussian_filter(rng.normal(size=scene.on.shape), 0.7) for _ in range(2))
        dark = scene.on & (scene.log_light < 2.0)
        scene.lost |= dark & (holes < np.quantile(holes, 0.35))
        darker = np.exp(np.minimum(2.0 - scene.log_light, 1.5))
        scene.log_light[dark] += (0.15 * darker * noise / noise.std())[dark]
        calls += len(found(scene)[1])
    assert calls <= 1  # 20 by the scatter of the rows alone


def test_the_noise_of_a_stain_is_as_large_as_the_scan_says() -> None:
    """A fortieth of the light around it and ten times the noise: no depth that is not the surface's."""
    calls = []
    for stated in (True, False):
        scene = Scene(seed=1)
        stain = np.hypot(scene.around - 15.0, scene.along) < 4.0
        scene.log_light[stain] -= np.log(40.0)
        scene.lift_mm[stain] *= 10.0
        scene.sigma_mm[stain] *= 10.0 if stated else 1.0
        calls.append(len(found(scene)[1]))
    assert calls == [0, 1]


@pytest.mark.parametrize("seed", range(5))
def test_a_dark_line_with_holes_stands_up(seed: int) -> None:
    scene = Scene(seed=seed)
    dark_line(scene)
    _, (place,) = found(scene)
    assert place.side == 1
    assert not place.depth_tells
    assert place.contrast == pytest.approx(1.1, abs=0.15)
    # 27 mm by 3 mm in cells of 0.86 mm
    assert place.above + place.below + place.unmeasured == place.cells.sum()
    assert place.cells.sum() == pytest.approx(27.0 * 3.0 / 0.8625**2, rel=0.2)


@pytest.mark.parametrize("seed", range(5))
def test_a_bright_line_below_the_surface_is_missing_material(seed: int) -> None:
    scene = Scene(seed=seed)
    bright_line(scene)
    _, (place,) = found(scene)
    assert place.side == -1
    assert place.depth_tells
    assert place.above < 0.1 * place.below


def test_a_few_holes_do_not_make_a_nick_a_burr_but_many_do() -> None:
    sides = []
    for share in (0.15, 0.6):
        scene = Scene()
        bright_line(scene)
        cells = scene.band(-25.0, 3.0, -10.0, 20.0)
        scene.lost |= cells & (np.random.default_rng(7).random(cells.shape) < share)
        _, (place,) = found(scene)
        sides.append(place.side)
    assert sides == [-1, 1]


@pytest.mark.parametrize(("low_mm", "places"), [(3.0, 0), (-15.0, 1)])
def test_a_small_hole_in_what_is_a_little_dark_is_none(low_mm: float, places: int) -> None:
    """9 mm by 3 mm are 36 cells, 27 by 3 are 109; light is the only witness."""
    scene = Scene()
    cells = scene.band(20.0, 3.0, low_mm, 12.0)
    scene.log_light[cells] -= 0.6
    scene.lost |= cells
    assert len(found(scene)[1]) == places


def test_two_lines_are_two_places_the_larger_first() -> None:
    scene = Scene()
    dark_line(scene, at=(20.0, 10.0, 25.0))
    bright_line(scene)
    _, places = found(scene)
    assert [one.side for one in places] == [-1, 1]
    assert places[0].cells.sum() > places[1].cells.sum()


@pytest.mark.parametrize("direction", LEANING)
def test_a_part_that_leans_shows_the_same(direction: tuple[float, float, float]) -> None:
    scene = Scene(direction)
    dark_line(scene, at=(12.0, -15.0, 12.0))
    surface, (place,) = found(scene)
    row, column = np.nonzero(place.cells)
    part = scene.in_part(scene.place_mm(12.0, -1.5))
    turn = np.angle(np.exp(1j * (surface.angle[column] - np.arctan2(part[1], part[0]))))
    assert place.side == 1
    assert turn.mean() * scene.radius_mm == pytest.approx(0.0, abs=0.5)
    assert surface.z_mm[row].mean() == pytest.approx(part[2], abs=0.8)
    assert np.ptp(surface.z_mm[row]) == pytest.approx(27.0, abs=2.5)


@pytest.mark.parametrize("unit", [1e-6, 1024.0])
def test_the_unit_of_light_does_not_matter(unit: float) -> None:
    scene = Scene()
    dark_line(scene)
    bright_line(scene)
    one, other = (found(scene, unit=each)[1] for each in (1.0, unit))
    assert len(one) == len(other) == 2
    for a, b in zip(one, other, strict=True):
        assert (a.cells != b.cells).sum() <= 2  # a cell at the very threshold
        assert a.side == b.side


@pytest.mark.parametrize("kind", ["even", "wild", "ragged"])
def test_an_edge_along_a_parallel_is_none(kind: str) -> None:
    scene = Scene(seed=4)
    rng = np.random.default_rng(40)
    band = scene.on & (np.abs(scene.along - 5.0) < 4.0)
    spots = rng.random(band.shape) < {"even": 1.0, "wild": 1.0, "ragged": 0.6}[kind]
    band &= spots
    scene.log_light[band] += 1.2 * (rng.normal(size=int(band.sum())) if kind != "even" else -1.0)
    scene.lift_mm[band] += 0.5 * rng.normal(size=int(band.sum()))
    scene.lost |= band & (rng.random(band.shape) < 0.4)
    assert found(scene)[1] == []


@pytest.mark.parametrize(("density", "expected"), [(0.0, 1), (0.02, 0), (0.04, 0)])
def test_what_is_like_its_parallels_is_none(density: float, expected: int) -> None:
    """Specks of four pixels all the way round: a cluster among them is the part's, alone it is a burr."""
    scene = Scene(seed=4)
    band = scene.on & (np.abs(scene.along - 5.0) < 6.0)
    corners = np.random.default_rng(60).random(band.shape) < density
    off = band & ndimage.binary_dilation(corners, np.ones((2, 2), bool))
    off |= scene.band(10.0, 4.0, 0.0, 10.0)
    scene.log_light[off] += 1.2
    scene.lift_mm[off] += 0.6
    assert len(found(scene)[1]) == expected


def test_nothing_is_missed_where_light_of_that_strength_is_hardly_measured() -> None:
    rng = np.random.default_rng(50)
    predicted = np.where(np.arange(60) < 30, -3.0, 2.0) + 0.05 * rng.normal(size=(40, 60))
    measured = rng.random(predicted.shape) < np.where(predicted < 0.0, 0.3, 0.9)
    predicted[:, 59] = np.nan
    is_open = np.ones(predicted.shape, bool)
    is_open[0] = False
    expected = is_open & (np.arange(60) >= 30) & (np.arange(60) < 59)
    np.testing.assert_array_equal(_measurable(predicted, measured, is_open), expected)
    assert not _measurable(np.full((3, 3), np.nan), np.ones((3, 3), bool), np.ones((3, 3), bool)).any()


def test_light_that_is_not_known_is_no_evidence() -> None:
    scene = Scene()
    cells = scene.band(20.0, 3.0, -15.0, 12.0)
    scene.log_light[cells] = np.nan
    scene.lost |= cells
    assert found(scene)[1] == []


def test_what_ends_beyond_the_part_is_not_looked_at() -> None:
    scene = Scene()
    dark_line(scene, at=(20.0, HALF_LENGTH_MM - 1.5, HALF_LENGTH_MM))
    assert found(scene)[1] == []


def test_lines_on_two_steps_are_two_places() -> None:
    """The curve's pieces lie 30 mm apart, and one would follow the other if nothing were between."""
    scene = Scene()
    dark_line(scene, at=(20.0, -35.0, -13.0))
    dark_line(scene, at=(20.0, 13.0, 35.0))
    low, high = scene.generatrix.z_mm
    z = np.array([low, low + 35.0, np.nan, high - 35.0, high])
    r = np.where(np.isnan(z), np.nan, scene.radius_mm)
    scene.generatrix = Generatrix(z, r, np.zeros(5), np.zeros(5))
    surface, places = found(scene)
    assert len(places) == 2
    ends = sorted(float(np.ptp(surface.z_mm[place.cells.any(axis=1)])) for place in places)
    assert ends == pytest.approx([20.0, 20.0], abs=2.0)


def test_a_faint_line_is_seen_though_the_scan_errs_at_its_rim(monkeypatch: pytest.MonkeyPatch) -> None:
    """As scans in one exposure do: what is looked at flatly is dark, and makes no parallel dull."""
    scene = Scene(seed=3)
    flatly = scene.on & (np.abs(scene.around) > 30.0)
    scene.lift_mm[flatly] *= 6.0
    line = scene.band(12.0, 1.7, -20.0, 20.0)
    scene.log_light[line] -= 0.7
    scene.lift_mm[line] += 0.05
    _, (place,) = found(scene)
    assert place.side == 1

    def by_rows(rest: Floats, _: Floats, *, least: float) -> Floats:
        return row_sigma(rest, least=least)[:, None]

    monkeypatch.setattr("burrscan.burrs.light.disturbed.cell_sigma", by_rows)
    assert found(scene)[1] == []


@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_light_that_bounced_in_a_corner_comes_and_goes_gradually(noise: float) -> None:
    """Two such places in grooves of turned wheels, 12 and 15 cells wide, were called burrs of 2 and 3 mm."""
    columns = np.arange(40)
    off = noise * np.random.default_rng(1).standard_normal((9, 40))

    def glint(across: Floats) -> bool:
        rest = np.full((20, 40), np.nan)
        rest[4:13] = across + off
        cells = np.zeros(rest.shape, bool)
        cells[4:13] = np.abs(across) > 0.3
        return _is_a_glint(cells, rest, wide=7.0)

    gradual: Floats = np.exp(-0.5 * ((columns - 20.0) / 5.0) ** 2)
    assert glint(gradual)
    assert glint(-gradual)
    assert not glint(np.where(np.abs(columns - 20) < 5, 1.0, 0.0))  # a burr's edges
    assert not glint(np.where(columns > 20, -gradual, gradual))  # a bright flank beside a dark one
    assert not glint(np.exp(-0.5 * ((columns - 20.0) / 1.5) ** 2))  # narrow, like a burr seen by few pixels
    unknown = np.full((20, 40), np.nan)
    assert not _is_a_glint(np.ones(unknown.shape, bool), unknown, wide=7.0)
