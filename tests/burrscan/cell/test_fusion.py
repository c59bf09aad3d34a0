"""Looks become one part: all of them measure a burr that one calls, and what stays open is worth less."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
from scipy.spatial import Delaunay

from burrscan.arrays import Floats, Ints32
from burrscan.cell.chart import AROUND, Chart, chart_of, line_of
from burrscan.cell.evidence import Call
from burrscan.cell.fusion import believed, fused
from burrscan.cell.look import Look
from burrscan.cell.outlook import Outlook, outlook
from burrscan.inspection import Burr, Inspection, Value
from burrscan.pipeline import Outcome
from burrscan.pose import placed
from burrscan.registration.joint import PosePrior
from burrscan.surface import Surface
from tests.burrscan.cell.parts import RADIUS_MM, STEP_MM, axis, burr, facing, generatrix, rig

_HEIGHT_MM = 0.8


def _seen(angle_deg: float, seed: int) -> tuple[Floats, Ints32]:
    """Points of the stepped drum around an angle, in the part frame, with a ridge at angle 0."""
    rng = np.random.default_rng(seed)
    angle, along = np.meshgrid(np.arange(-0.6, 0.6, 0.006), np.arange(0.0, 100.0, 0.5))
    angle = (angle + np.radians(angle_deg) + 0.006 * rng.random()).ravel()
    z = np.clip(along, 0.0, 40.0) + np.clip(along - 60.0, 0.0, 40.0)
    r = RADIUS_MM + np.clip(along - 40.0, 0.0, STEP_MM - RADIUS_MM)
    z, r = z.ravel(), r.ravel()
    ridge = _HEIGHT_MM * np.clip(1.0 - np.abs(angle) * RADIUS_MM / 0.8, 0.0, None) * (np.abs(z - 20.0) < 5.0)
    r = r + ridge + 0.01 * rng.normal(size=r.shape)
    faces = Delaunay(np.stack([angle * RADIUS_MM, along.ravel()], axis=1)).simplices.astype(np.int32)
    return np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1), faces


def _look(number: int, angle_deg: float, called: Burr) -> Look:
    T_camera_part = facing(angle_deg)
    vertices, faces = _seen(angle_deg, number)
    surface = Surface(
        points_mm=np.zeros((1, 1, 3)),
        sigma_mm=np.zeros((1, 1), np.float32),
        mask=np.ones((1, 1), np.bool_),
        vertices_mm=placed(T_camera_part, vertices),
        vertex_sigma_mm=np.full(len(vertices), 0.01),
        faces=faces,
        pixels=np.zeros((len(vertices), 2), np.int32),
    )
    seen = replace(called, T_mesh_burr=T_camera_part @ called.T_mesh_burr)
    inspection = Inspection(axis(), generatrix(step=True), (seen,), np.eye(4), np.zeros(0))
    T_part_camera = np.asarray(np.linalg.inv(T_camera_part), float)
    return Look(number, T_part_camera, Outcome(cast(Any, None), surface, inspection))


@pytest.mark.study
def test_a_burr_that_is_called_is_measured_by_all_looks() -> None:
    """Each call says half of the height, and so does their mean: 0.4 ± 0.3; the vertices say 0.8."""
    called = replace(burr(height_mm=0.5 * _HEIGHT_MM, sigma_mm=0.3), width_mm=Value(1.6, 0.4))
    looks = [_look(n, angle, called) for n, angle in enumerate((-14.0, -5.0, 4.0, 13.0))]
    found = fused(looks, rig(), prior=PosePrior(sigma_mm=0.05, sigma_deg=0.01), burrs=2.0)
    (place,) = found.places
    assert place.certain
    assert place.burr.height_mm.value == pytest.approx(_HEIGHT_MM, abs=0.06)
    assert place.burr.height_mm.sigma < 0.1


@pytest.mark.study
def test_what_only_an_outline_shows_has_a_width() -> None:
    """A mill's lanes follow from it, and which calls are of one burr: one of two looks knows none."""
    prior, known = PosePrior(sigma_mm=0.05, sigma_deg=0.01), burr(height_mm=0.8, significance=40.0)
    outline = replace(known, width_mm=Value(np.nan, np.nan), area_mm2=Value(np.nan, np.nan))
    for first in (known, outline):
        looks = [_look(0, -14.0, first), _look(1, 13.0, outline)]
        (place,) = fused(looks, rig(), prior=prior, burrs=2.0).places
        assert len(place.calls) == 2
        assert np.isfinite(place.burr.width_mm.value)


def test_a_place_that_stayed_open_when_it_was_faced_is_worth_half() -> None:
    chart = chart_of(generatrix())
    rolled = np.eye(4)
    rolled[:2, :2] = [[0.0, -1.0], [1.0, 0.0]]
    view = outlook(chart, rig(), rolled @ facing(0.0), chart.angles)
    one = burr()
    call = Call(0, one, np.array(one.T_mesh_burr), 5.0, faced=True, along=True)
    worth = [_suspicion(call, view, chart, looks) for looks in (2, 3)]
    assert worth[0] > 0.0
    # of the same probability: a third look that faced it without a word halves what another is worth
    assert worth[1] == pytest.approx(0.5 * worth[0], rel=1e-6)


def _suspicion(call: Call, view: Outlook, chart: Chart, looks: int) -> float:
    """On the map, over p (1 - p): ``looks`` faced the place, and one of them called it."""
    dark = np.zeros(chart.shape)
    measured = np.full(chart.shape, 0.8)
    seen = [(view, measured), (view, measured), *[(view, dark)] * (looks - 2)]
    belief, (place,) = believed([call], seen, axis=axis(), chart=chart, burrs=2.0)
    pose = np.array(call.burr.T_mesh_burr)
    assert belief.suspicion[line_of(pose)].sum() == belief.suspicion.sum()
    assert belief.suspicion.shape[-1] == AROUND
    return float(belief.suspicion.sum() / (place.probability * (1.0 - place.probability)))
