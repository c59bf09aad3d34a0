"""Burrs along an edge: as long as a sixth of the wheel, several on one edge, from aside and from above."""

from __future__ import annotations

import numpy as np
import pytest

from bench.synthetic.depth_view import single_view
from burrscan.api import inspect_mesh
from burrscan.arrays import Bools, Ints
from burrscan.burrs import detect, field
from burrscan.inspection import Burr
from scenes.wheel import RimBurr, build_wheel, load_wheel

_HEIGHT_MM, _RADIUS_MM = 1.2, 70.0


def called(
    *angles_deg: float, arc_deg: float, direction: str, from_deg: float, seed: int = 0
) -> tuple[Burr, ...]:
    """What is called of burrs on the largest edge of the stepped hub, seen from so far above its plane."""
    burrs = [
        RimBurr(
            angle_deg=at,
            arc_deg=arc_deg,
            height_mm=_HEIGHT_MM,
            width_mm=1.0,
            edge=(20.0, _RADIUS_MM),
            direction=direction,  # type: ignore[arg-type]
        )
        for at in angles_deg
    ]
    wheel = build_wheel(load_wheel("stepped_hub"), burrs, facet_error_mm=0.01)
    up = np.radians(from_deg)
    view = -np.array([np.cos(up), 0.0, np.sin(up)])
    return inspect_mesh(*single_view(*wheel.welded(), view, pixels=300, sigma=0.02, seed=seed)).burrs


@pytest.mark.parametrize(
    ("angles_deg", "arc_deg", "direction", "from_deg"),
    [
        ((0.0,), 60.0, "radial", 17.0),
        ((-40.0, -5.0, 30.0), 20.0, "radial", 17.0),
        ((-40.0, -5.0, 30.0), 20.0, "axial", 63.0),
        pytest.param((-35.0, 20.0), 30.0, "radial", 17.0, marks=pytest.mark.study),
        pytest.param((-50.0, 0.0, 45.0), 30.0, "axial", 63.0, marks=pytest.mark.study),
        pytest.param((-35.0, 25.0), 45.0, "axial", 63.0, marks=pytest.mark.study),
    ],
)
def test_every_burr_of_an_edge_is_measured(
    angles_deg: tuple[float, ...], arc_deg: float, direction: str, from_deg: float
) -> None:
    found = called(*angles_deg, arc_deg=arc_deg, direction=direction, from_deg=from_deg)
    assert [burr.side for burr in found] == ["protrusion"] * len(angles_deg)
    assert [burr.height_mm.value for burr in found] == pytest.approx([_HEIGHT_MM] * len(found), abs=0.05)
    long_mm = np.radians(arc_deg) * _RADIUS_MM
    assert [burr.length_mm.value for burr in found] == pytest.approx([long_mm] * len(found), rel=0.05)


def test_the_level_of_an_edge_is_that_of_its_arc_and_not_of_its_vertices(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A burr's flanks have most vertices of an edge: told by these, the burr is the edge."""
    assert len(called(0.0, arc_deg=60.0, direction="radial", from_deg=40.0)) == 1

    def each(place: Ints) -> Ints:
        return np.ones_like(place)

    monkeypatch.setattr(field, "_mates", each)
    assert not called(0.0, arc_deg=60.0, direction="radial", from_deg=40.0)


def test_a_gap_is_no_burr(monkeypatch: pytest.MonkeyPatch) -> None:
    """Long boxes over the gap between two burrs stand out as well, and made one burr of both."""
    burrs = {"arc_deg": 20.0, "direction": "radial", "from_deg": 17.0}
    assert len(called(-40.0, -5.0, **burrs)) == 2  # type: ignore[arg-type]

    def nowhere(plain: Bools, *_: object) -> Bools:
        return np.zeros_like(plain)

    monkeypatch.setattr(detect, "_between", nowhere)
    assert len(called(-40.0, -5.0, **burrs)) == 1  # type: ignore[arg-type]


def test_a_short_gap_is_within_one_burr() -> None:
    """Two degrees are 2.4 mm: a torn burr's gap."""
    found = called(-10.5, 10.5, arc_deg=19.0, direction="radial", from_deg=17.0)
    assert [round(burr.length_mm.value / 10.0) for burr in found] == [5]
