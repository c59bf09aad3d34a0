"""How far apart vertices lie where a surface is grazed, and what a burr narrower than that can tell."""

from __future__ import annotations

import numpy as np
import pytest

from bench.synthetic.revolution import grid_faces
from burrscan.arrays import Floats
from burrscan.burrs import field
from burrscan.burrs.describe import Site, describe
from burrscan.burrs.pitch import pitches_mm
from burrscan.burrs.shape.crest import with_tip
from burrscan.burrs.shape.section import Kind, section
from burrscan.inspection import Axis, Generatrix, Value

_RADIUS_MM, _HEIGHT_MM, _BASE_MM = 30.0, 0.3, 0.9


@pytest.mark.parametrize("turned", [0.0, np.pi, -2.0])
def test_rows_and_columns_are_told_apart_and_a_turn_changes_nothing(turned: float) -> None:
    z, angle = (
        grid.ravel() for grid in np.meshgrid(1.5 * np.arange(6), 0.02 * np.arange(9) + turned, indexing="ij")
    )
    wrapped = (angle + np.pi) % (2.0 * np.pi) - np.pi
    faces = grid_faces(6, 9).astype(np.int32)
    some = np.arange(9, 54)  # the first row has no place on the curve
    pitch = pitches_mm(z[some], wrapped[some], np.full(45, 25.0), faces, some, count=54)
    assert pitch == pytest.approx(np.tile([1.5, 0.5], (45, 1)))


def test_a_vertex_without_a_triangle_has_no_pitch() -> None:
    place = np.array([0.0, 1.0, 0.0, 5.0])
    faces = np.array([[0, 1, 2], [1, 2, 4]], np.int32)
    pitch = pitches_mm(place, 0.1 * place, np.ones(4), faces, np.array([0, 1, 2, 3]), count=5)
    assert np.isnan(pitch[3]).all()
    assert pitch[0] == pytest.approx([1.0, 0.1])


def grazed(seed: int, *, row_mm: float) -> Value:
    """How high a ridge around a cylinder is called where rows of pixels are so high; elsewhere 0.45 mm.

    The rows run askew to the ridge, as a camera's do.
    """
    rng = np.random.default_rng(seed)
    angle = 0.45 / _RADIUS_MM * (np.arange(150) - 75)
    rows = np.unique(np.concatenate([np.arange(-40.0, -9.0, 0.45), np.arange(-9.0, 9.0, row_mm)]))
    z = rows[:, None] + 2.0 * angle
    lift = _HEIGHT_MM * section(z, _BASE_MM / 2.0, _BASE_MM / 2.0, Kind(1, row_mm))[0]
    lift = lift * (np.abs(angle) < 0.4) + 0.008 * rng.normal(size=z.shape)
    r = _RADIUS_MM + lift
    places = np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=-1).reshape(-1, 3)
    axis = Axis(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.zeros((4, 4)), "exact")
    ends = np.array([z.min(), z.max()])
    curve = Generatrix(ends, np.full(2, _RADIUS_MM), np.zeros(2), np.zeros(2))
    shown = field.field_of(places, grid_faces(*z.shape).astype(np.int32), axis, curve, sigma_mm=0.008)
    near = np.flatnonzero(np.abs(z.ravel()) < 6.0)
    burr = describe(shown, Site(near, lift.ravel()[near] > 0.05, 1, 20.0), axis)
    assert burr is not None
    return burr.height_mm


def usual(along: Floats, *_: object, **__: object) -> Floats:
    return np.full((len(along), 2), 0.45)


def test_a_burr_narrower_than_a_grazed_row_is_as_unsure_as_that(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its row shows a fraction of it: believed to be as fine as elsewhere, that is stated as its height."""

    def pulls() -> Floats:
        heights = [grazed(seed, row_mm=1.0) for seed in range(6)]
        return np.array([(height.value - _HEIGHT_MM) / height.sigma for height in heights])

    assert np.abs(pulls()).max() < 3.0
    monkeypatch.setattr(field, "pitches_mm", usual)
    assert np.abs(pulls()).max() > 20.0


@pytest.mark.parametrize("base_mm", [0.7, 1.0, 1.6])
@pytest.mark.parametrize("pixel_mm", [0.0, 0.3, 0.5])
def test_a_crest_that_pixels_average_is_told_with_its_tip(base_mm: float, pixel_mm: float) -> None:
    seen = 1.2 * float(section(np.zeros(1), base_mm / 2.0, base_mm / 2.0, Kind(1, pixel_mm))[0][0])
    told = with_tip(Value(seen, 0.02), width_mm=base_mm, footprint_mm=pixel_mm)
    assert abs(told.value - 1.2) < 2.0 * told.sigma
    assert told.sigma < 0.2
    if pixel_mm == 0.0:
        assert told == Value(seen, 0.02)


def test_of_a_tip_narrower_than_a_pixel_no_more_is_missed_than_is_seen() -> None:
    told = with_tip(Value(0.4, 0.0), width_mm=0.1, footprint_mm=2.0)
    assert told.value == pytest.approx(0.6)
    assert told.value + np.sqrt(3.0) * told.sigma == pytest.approx(0.8)
