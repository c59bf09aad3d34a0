"""Handles, bars and fixtures: what stands on a surface of revolution and is too large for a burr."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.synthetic.axis_parts import handled
from bench.synthetic.depth_view import single_view
from bench.synthetic.ordinary_parts import Mesh, box, closed, joined, turned
from burrscan.api import inspect_mesh
from burrscan.arrays import Floats
from burrscan.burrs import residual
from burrscan.burrs.bodies import of_another_body
from burrscan.generatrix.deviation import feet_of, further_than
from burrscan.generatrix.polyline import polyline_of
from burrscan.inspection import Generatrix
from burrscan.pipeline import Stage

RADIUS_MM, HEIGHT_MM = 40.0, 1.5


def drum(*, ridge_mm: float = HEIGHT_MM) -> Mesh:
    """A drum with a ridge at 20 degrees."""

    def lift(z: Floats, r: Floats, angle: Floats) -> Floats:
        tent = np.clip(1.0 - np.abs(angle - np.radians(20.0)) * RADIUS_MM / 1.2, 0.0, None)
        return np.asarray(1.0 + ridge_mm / RADIUS_MM * tent * (np.abs(z) < 15.0) * (r > 0.9 * RADIUS_MM))

    outline = [(-30.0, 0.0), (-30.0, RADIUS_MM), (30.0, 0.95 * RADIUS_MM), (30.0, 0.0)]
    return turned(closed(outline), around=1440, lift=lift)


def seen(part: Mesh) -> Mesh:
    """One view of it, from aside."""
    return single_view(*part, np.array([-1.0, 0.0, -0.4]), pixels=240, sigma=0.05, seed=3)


def bar(*, out_mm: float) -> Mesh:
    """What stands on the drum at -25 degrees, 8 by 12 mm across and ``out_mm`` high."""
    points, faces = box((0.8 * RADIUS_MM, RADIUS_MM + out_mm), (-4.0, 4.0), (-6.0, 6.0))
    cosine, sine = np.cos(np.radians(-25.0)), np.sin(np.radians(-25.0))
    turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return points @ turn.T, faces


@pytest.mark.parametrize("out_mm", [8.0, 30.0])
def test_a_burr_beside_a_bar_is_the_only_one(out_mm: float) -> None:
    vertices, faces = seen(joined([drum(), bar(out_mm=out_mm)]))
    (burr,) = inspect_mesh(vertices, faces).burrs
    assert burr.side == "protrusion"
    assert burr.height_mm.value == pytest.approx(HEIGHT_MM, abs=0.2)


@pytest.mark.study
def test_handles_are_no_burrs_and_their_feet_are_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(residual, "MOST_OPEN", 1.0)  # some have an edge that hides what is behind
    whole, feet = 0, 0
    for seed in range(6):
        view = seen(handled(np.random.default_rng(seed)))
        whole += len(inspect_mesh(*view).burrs)
        feet += len(inspect_mesh(*view, burrs=Stage("residual", {"tallest_mm": 1000.0})).burrs)
    assert whole == 0
    assert feet >= 4


def test_a_bar_no_higher_than_a_burr_is_called() -> None:
    assert len(inspect_mesh(*seen(joined([drum(), bar(out_mm=3.0)]))).burrs) >= 2


def test_a_burr_of_a_pin_is_a_burr_though_it_is_a_sixth_of_its_radius() -> None:
    vertices, faces = drum(ridge_mm=6.0)
    vertices, faces = seen((vertices / 8.0, faces))
    (burr,) = inspect_mesh(vertices, faces).burrs
    assert burr.side == "protrusion"


@given(st.permutations(range(50)), st.integers(0, 20))
def test_a_piece_is_whole_and_a_few_strays_make_none(order: list[int], beyond: int) -> None:
    """A strip of which 30 vertices are on the curve; some of the other 20 are far away."""
    strip = np.array([(i, i + 1, i + 2) for i in range(48)], dtype=np.int32)
    distance = np.where(np.arange(50) < 30, 0.01, 1.0)
    far = np.arange(50) >= 50 - beyond
    place = np.argsort(order).astype(np.int32)
    other = of_another_body(place[strip], distance[order], far[order])
    expected = (np.arange(50) >= 30) & (beyond >= 10)
    np.testing.assert_array_equal(other, expected[order])


def test_far_is_counted_from_the_nearest_curve() -> None:
    z = np.linspace(0.0, 20.0, 21)
    line = polyline_of(Generatrix(z, np.full(21, 30.0), np.full(21, 0.1), np.full(21, 0.1)))
    z = np.array([10.0, 10.0, 10.0, 23.0, 40.0, np.nan])
    r = np.array([30.1, 34.0, 36.0, 31.0, 30.0, 30.0])
    far = further_than(5.0, z, r, line, feet_of(z, r, line))
    np.testing.assert_array_equal(far, [False, False, True, False, True, False])
