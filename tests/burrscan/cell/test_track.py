"""A burr is found again where it is, from points of a drum with a ridge."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from burrscan.arrays import Floats
from burrscan.axis.basis import T_part_mesh
from burrscan.cell.track import Tracked, tracked
from burrscan.generatrix import deviation_mm
from burrscan.inspection import Inspection
from burrscan.pipeline import Outcome
from burrscan.rig import Rig
from tests.burrscan.cell.parts import RADIUS_MM, axis, burr, generatrix

_PITCH_MM = 0.5
_NOISE_MM = 0.05
_RIG = cast(Rig, SimpleNamespace(projector_centre_mm=np.array([0.0, 0.0, 200.0])))
"""Its baseline lies along the burr."""


def _look(
    rng: np.random.Generator,
    at_mm: float,
    *,
    slant: float = 0.05,
    ridge_mm: float = 1.0,
    flank_low_mm: float = 0.0,
    flank_sigma_mm: float = _NOISE_MM,
    shown_z_mm: tuple[float, float] = (15.0, 25.0),
) -> Outcome:
    """A drum seen in the frame of the part, its ridge ``at_mm`` beside angle 0, its left flank wrong."""
    z, off = np.meshgrid(np.arange(0.2, 39.8, 0.7), np.arange(-8.0, 8.0, _PITCH_MM), indexing="ij")
    off = off + _PITCH_MM * rng.uniform() + slant * z
    beside = off - at_mm
    shown = (z > shown_z_mm[0]) & (z < shown_z_mm[1])
    ridge = np.where(shown, ridge_mm * np.clip(1.0 - np.abs(beside) / 0.75, 0.0, None), 0.0)
    flank = (ridge > 0.0) & (beside < 0.0)
    sigma = np.where(flank, flank_sigma_mm, _NOISE_MM)
    radius = RADIUS_MM + ridge - np.where(flank, flank_low_mm, 0.0) + sigma * rng.normal(size=z.shape)
    angle = off / RADIUS_MM
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=-1).reshape(-1, 3)
    line, centre = generatrix(), axis()
    frame = T_part_mesh(centre.point_mm, centre.direction)
    inspection = Inspection(centre, line, (), frame, deviation_mm(points, centre, line))
    surface = SimpleNamespace(
        vertices_mm=points, vertex_sigma_mm=sigma.ravel(), points_mm=np.empty((0, 0, 3))
    )
    scan = SimpleNamespace(radiance=None)  # no light: by depth alone
    return cast(Outcome, SimpleNamespace(scan=scan, surface=surface, inspection=inspection))


def _found(outcome: Outcome, rig: Rig = _RIG) -> Tracked | None:
    target = burr(0.0)
    pose = np.array(target.T_mesh_burr)
    return tracked(outcome, target, pose, rig=rig, gate_mm=2.0, pixel_mm=_PITCH_MM)


def _errors(seed: int, count: int, **world: Any) -> Floats:
    """(count, 2) errors of the place across, mm, and the standard deviations stated; NaN where not found."""
    rng = np.random.default_rng(seed)
    rows = []
    for _ in range(count):
        at = rng.uniform(-1.5, 1.5)
        found = _found(_look(rng, at, **world))
        if found is None:
            rows.append([np.nan, np.nan])
        else:
            x, y, _z = found.burr.T_mesh_burr[:3, 3]
            rows.append([float(np.arctan2(y, x)) * RADIUS_MM - at, found.across_sigma_mm])
    return np.array(rows)


def test_the_place_and_what_is_stated_of_it() -> None:
    errors = _errors(1, 60)
    rms = float(np.sqrt((errors[:, 0] ** 2).mean()))
    # 15 rows of 3 points on flanks that rise by 1 mm in 0.75 mm: the bound is 0.05 / sqrt(45) / 1.33 = 0.006
    assert rms < 0.012
    assert abs(errors[:, 0].mean()) < 3.0 * rms / np.sqrt(60)
    # no less than it is; pieces of the length sample the section differently, which counts as scatter
    assert 0.5 < rms / float(np.sqrt((errors[:, 1] ** 2).mean())) < 1.15


def test_a_flank_that_is_uncertain_counts_less() -> None:
    known = _errors(2, 30, flank_low_mm=0.3, flank_sigma_mm=0.09)
    unknown = _errors(2, 30, flank_low_mm=0.3, flank_sigma_mm=_NOISE_MM)
    assert abs(unknown[:, 0].mean()) > 1.3 * abs(known[:, 0].mean())


def test_rows_at_a_slant_tell_the_place_better_than_rows_along_the_burr() -> None:
    slanted, aligned = (
        float(np.mean(np.abs(_errors(3, 40, slant=slant)[:, 0]) < 0.02)) for slant in (_PITCH_MM / 10.0, 0.0)
    )
    assert slanted > 0.95
    assert aligned < 0.8


@pytest.mark.parametrize("what", ["no ridge", "another side"])
def test_what_is_not_there_is_not_found(what: str) -> None:
    rng = np.random.default_rng(4)
    height = 0.0 if what == "no ridge" else -1.0
    assert all(_found(_look(rng, 0.0, ridge_mm=height)) is None for _ in range(10))


def test_one_flank_alone_is_no_place() -> None:
    rng = np.random.default_rng(5)
    # what mirrors the part is measured wrongly, and says so
    wild = [_found(_look(rng, 0.0, flank_low_mm=1.0, flank_sigma_mm=2.0)) for _ in range(30)]
    assert sum(one is None for one in wild) > 5
    # where the foot of the flank tells enough, a section that is no parabola costs some hundredths
    assert all(one is None or abs(one.burr.T_mesh_burr[1, 3]) < 0.12 for one in wild)


def test_a_baseline_across_the_burr_leaves_its_place_uncertain_by_its_width() -> None:
    rng = np.random.default_rng(6)
    for degrees, least in ((0.0, 0.0), (20.0, 0.05), (90.0, np.inf)):
        way = 200.0 * np.array([0.0, np.sin(np.radians(degrees)), np.cos(np.radians(degrees))])
        found = _found(_look(rng, 0.0), cast(Rig, SimpleNamespace(projector_centre_mm=way)))
        assert (np.inf if found is None else found.across_sigma_mm) >= least


def test_a_burr_that_the_detector_calls_is_found_though_its_flanks_show_little_of_its_height() -> None:
    rng = np.random.default_rng(7)
    for _ in range(10):
        look = _look(rng, 0.4, ridge_mm=0.3)
        assert _found(look) is None
        called = replace(look.inspection, burrs=(burr(np.degrees(0.5 / RADIUS_MM)),))
        known = SimpleNamespace(scan=look.scan, surface=look.surface, inspection=called)
        found = _found(cast(Outcome, known))
        assert found is not None
        assert found.burr.T_mesh_burr[1, 3] == pytest.approx(0.4, abs=0.12)


@pytest.mark.parametrize(
    ("shown", "reaches"),
    [
        ((18.5, 25.0), (15.0, 25.0)),  # a third of it mirrors the part
        ((16.5, 26.5), (16.5, 26.5)),  # all of it, on a part that was moved
        ((19.5, 26.5), (16.5, 26.5)),  # both
        ((14.0, 26.0), (14.0, 26.0)),  # longer than it was known to be
    ],
)
def test_a_look_that_shows_a_piece_of_a_burr_makes_it_no_shorter(
    shown: tuple[float, float], reaches: tuple[float, float]
) -> None:
    found = _found(_look(np.random.default_rng(5), 0.3, shown_z_mm=shown))
    assert found is not None
    middle, half = float(found.burr.T_mesh_burr[2, 3]), 0.5 * found.burr.length_mm.value
    assert (middle - half, middle + half) == pytest.approx(reaches, abs=0.7)  # a row of points


def test_a_look_that_shows_none_of_a_burrs_height_leaves_it_where_it_was() -> None:
    look = _look(np.random.default_rng(6), 0.0, ridge_mm=0.25)  # flanks that mirror: a quarter of its height
    seen = look.surface.vertices_mm[:, 2] > 20.0  # and half of it is not measured
    surface = SimpleNamespace(
        vertices_mm=look.surface.vertices_mm[seen],
        vertex_sigma_mm=look.surface.vertex_sigma_mm[seen],
        points_mm=look.surface.points_mm,
    )
    inspection = replace(look.inspection, deviation_mm=look.inspection.deviation_mm[seen])
    called = burr(0.0)
    rest = cast(
        Outcome,
        SimpleNamespace(scan=look.scan, surface=surface, inspection=replace(inspection, burrs=(called,))),
    )
    found = _found(rest)
    assert found is not None
    assert found.burr.T_mesh_burr[2, 3] == pytest.approx(20.0, abs=0.1)
    assert found.burr.length_mm.value == pytest.approx(called.length_mm.value, abs=0.1)
