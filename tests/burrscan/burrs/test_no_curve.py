"""Edges of surfaces that the generatrix does not have are no burrs; burrs of every family are."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.synthetic.clean_command import seen
from bench.synthetic.depth_view import single_view
from burrscan.api import inspect_mesh
from burrscan.burrs import describe, residual
from burrscan.burrs.no_curve import shares_without
from burrscan.generatrix.deviation import feet_of, past_ends
from burrscan.generatrix.polyline import polyline_of
from burrscan.inspection import Burr, Generatrix
from burrscan.pipeline import Stage
from scenes.wheel import AxialRidge, BurrSpec, Nick, RimBurr, TrueBurr, build_wheel, load_wheel
from tests.tiers import some_of

EDGES = (
    ("spokes", 31002),  # bars that run through the rim, and whose ends hang on it
    ("spokes", 31048),
    ("spokes", 31050),
    ("treads", 30028),  # the shoulder, where the curve of the lugs ends before the edge
    ("flutes", 97168),
    ("spokes", 97001),
    ("spokes", 97074),
)
NO_NICKS = (("treads", 30005), ("treads", 30022), ("handles", 30099))
"""Shoulders where vertices on either side of an edge lie scattered between two surfaces."""


TALL = Stage("residual", {"tallest_mm": 10.0})
"""Twice as high as usual, or most of these edges are those of other bodies."""


def calls(views: tuple[tuple[str, int], ...]) -> int:
    meshes = [seen(part, number, noise=0.001)[0] for part, number in views]
    return sum(len(inspect_mesh(*mesh, burrs=TALL).burrs) for mesh in meshes)


@pytest.mark.study
def test_edges_of_surfaces_without_a_curve_are_no_burrs(monkeypatch: pytest.MonkeyPatch) -> None:
    assert calls(EDGES) == 0
    monkeypatch.setattr(residual, "MOST_WITHOUT", 1.0)
    assert calls(EDGES) >= 7


@pytest.mark.study
def test_what_is_not_like_its_description_is_no_nick(monkeypatch: pytest.MonkeyPatch) -> None:
    assert calls(NO_NICKS) == 0
    monkeypatch.setattr(describe, "_LEAST_EXPLAINED", -np.inf)
    assert calls(NO_NICKS) == 3


def ridge(angle_deg: float, height_mm: float, width_mm: float, **shape: Any) -> AxialRidge:
    return AxialRidge(
        angle_deg=angle_deg, height_mm=height_mm, width_mm=width_mm, z_start_mm=1.0, z_end_mm=19.0, **shape
    )


TORN = {
    "height_rms": 0.4,
    "lean_rms_deg": 12.0,
    "thickness_rms": 0.3,
    "gap_share": 0.3,
    "correlation_mm": 3.0,
}
FAMILIES: tuple[BurrSpec, ...] = (
    ridge(-50.0, 0.6, 1.5),
    ridge(-35.0, 1.5, 2.5, section="rounded", height_rms=0.1),
    ridge(-20.0, 2.0, 1.2, section="rolled", curl_deg=120.0),
    ridge(-5.0, 2.0, 0.8, section="flake", lean_deg=35.0),
    ridge(10.0, 1.6, 1.6, section="flake", **TORN),
    Nick(angle_deg=25.0, depth_mm=0.8, width_mm=2.0, depth_variation=0.4, z_start_mm=1.0, z_end_mm=19.0),
    Nick(angle_deg=38.0, depth_mm=1.2, width_mm=1.2, z_start_mm=14.0, z_end_mm=25.0),
    RimBurr(angle_deg=52.0, arc_deg=15.0, height_mm=1.5, width_mm=1.0, edge=(20.0, 70.0), direction="axial"),
)
"""On the largest cylinder of the stepped hub; the second nick runs out over its edge."""


@some_of("pixels", [250, 500])
@some_of("tilt_deg", [40.0, 0.0])
def test_burrs_of_every_family_stay(pixels: int, tilt_deg: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """All that are called without both rules; at most one is not: a rim burr seen from aside, say."""
    wheel = build_wheel(load_wheel("stepped_hub"), FAMILIES, facet_error_mm=0.01)
    tilt = np.radians(tilt_deg)
    view = -np.array([np.cos(tilt), 0.0, np.sin(tilt)])
    scan = single_view(*wheel.welded(), view, pixels=pixels, sigma=0.02, seed=pixels)
    found = inspect_mesh(*scan).burrs
    called = [any(_is(true, one) for one in found) for true in wheel.burrs]
    assert sum(called) >= len(FAMILIES) - 1
    monkeypatch.setattr(residual, "MOST_WITHOUT", 1.0)
    monkeypatch.setattr(describe, "_LEAST_EXPLAINED", -np.inf)
    assert len(inspect_mesh(*scan).burrs) == len(found)


def _is(true: TrueBurr, found: Burr) -> bool:
    place = found.T_mesh_burr[:3, 3]
    aside = np.abs(np.degrees(np.arctan2(place[1], place[0])) - true.angle_deg)
    return found.side == true.side and bool(aside < max(2.0, 0.6 * true.arc_deg))


@given(st.permutations(range(40)), st.integers(0, 12))
def test_shares_are_of_the_vertices_next_to_each_anomaly(order: list[int], without: int) -> None:
    """A strip of faces: an anomaly of three vertices has two neighbours on each side, one at an end."""
    strip = np.array([(i, i + 1, i + 2) for i in range(38)], dtype=np.int32)
    place = np.argsort(order)
    off = np.zeros(40, dtype=np.bool_)
    off[place[:without]] = True
    shares = shares_without(place[strip].astype(np.int32), off, [place[10:13], place[20:23], place[37:40]])
    beside = ([8, 9, 13, 14], [18, 19, 23, 24], [35, 36])
    expected = [np.mean([index < without for index in each]) for each in beside]
    np.testing.assert_allclose(shares, expected)


def test_beside_the_vertices_of_a_cloud_lies_nothing() -> None:
    none = np.zeros((0, 3), dtype=np.int32)
    np.testing.assert_array_equal(shares_without(none, np.ones(9, np.bool_), [np.arange(4)]), [0.0])


def test_past_an_end_is_what_lies_near_the_curve_and_beyond_it() -> None:
    """A cylinder of 30 mm from z = 0 to 20; what is higher than the reach of 3 mm is past nothing."""
    z = np.linspace(0.0, 20.0, 21)
    line = polyline_of(Generatrix(z, np.full(21, 30.0), np.full(21, 0.1), np.full(21, 0.1)))
    z = np.array([10.0, 10.0, 20.3, 22.0, -1.5, 22.0, 30.0, np.nan])
    r = np.array([30.5, 38.0, 30.0, 31.0, 30.0, 38.0, 30.0, 30.0])
    past = past_ends(z, r, line, feet_of(z, r, line))
    np.testing.assert_array_equal(past, [False, False, True, True, True, False, False, False])
