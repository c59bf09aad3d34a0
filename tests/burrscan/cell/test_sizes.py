"""Sizes from several looks at once: sections that no look resolves, errors that vertices share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from burrscan.arrays import Floats
from burrscan.cell.chart import beside, walked
from burrscan.cell.sizes import Cloud, Shown, sided, sides, sized
from burrscan.inspection import Burr, Value
from tests.burrscan.cell.parts import RADIUS_MM, axis, burr

_PX_MM = 0.5
_WIDTH_MM = 1.6
Section = Callable[[Floats], Floats]


def _flat_topped(across: Floats) -> Floats:
    """A flake's unit section: steep flanks and a flat top over half of its base."""
    return np.clip((1.0 - np.abs(across) / (0.5 * _WIDTH_MM)) * 2.0, 0.0, 1.0)


def _triangle(across: Floats) -> Floats:
    return np.clip(1.0 - np.abs(across) / (0.5 * _WIDTH_MM), 0.0, 1.0)


def _cloud(
    seed: int, height_mm: float, *, section: Section = _flat_topped, scale: float = 1.0, flank: int = 0
) -> Cloud:
    """A look at a drum with a ridge at angle 0, z from 15 to 25 mm: rows of pixels, half a millimetre apart.

    ``scale`` is what the look makes of heights; of the two flanks it may see only one (-1 or 1).
    """
    rng = np.random.default_rng(seed)
    rows, z = np.arange(-8.0, 8.0, _PX_MM) + _PX_MM * rng.random(), np.arange(8.0, 32.0, _PX_MM)
    across, along = np.meshgrid(rows, z + _PX_MM * rng.random())
    seen = flank * across >= -0.1
    across, along = across[seen], along[seen]
    pixel = np.linspace(-0.5, 0.5, 21) * _PX_MM  # which sees a mean
    true = height_mm * section(across[:, None] + pixel).mean(axis=1) * (np.abs(along - 20.0) < 5.0)
    deviation = scale * true + 0.02 * rng.normal(size=true.shape)
    angle, radius = across / RADIUS_MM, RADIUS_MM + deviation
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), along], axis=1)
    return Cloud(points, deviation, np.full(len(points), 0.02), _PX_MM)


def _called(height_mm: float, sigma_mm: float) -> Burr:
    return replace(burr(height_mm=height_mm, sigma_mm=sigma_mm), width_mm=Value(1.3, 0.4))


def _pose(called: Burr) -> Floats:
    return np.array(called.T_mesh_burr)


def together(called: Burr, pose: Floats, looks: list[Cloud]) -> Shown | None:
    """What all looks show of it on the side that it was called on."""
    return sides(called, pose, looks).get(called.side)


def _measured(called: Burr, looks: list[Cloud], pose: Floats | None = None) -> Burr:
    """The burr as looks show it on the side that it was called on."""
    pose = _pose(called) if pose is None else pose
    shown = together(called, pose, looks)
    assert shown is not None
    return sized(shown, axis(), pose)


def _dented(looks: list[Cloud]) -> list[Cloud]:
    return [look._replace(deviation_mm=-look.deviation_mm) for look in looks]


@pytest.mark.parametrize(("section", "width_mm"), [(_flat_topped, 1.6), (_triangle, 1.6)])
def test_looks_together_show_a_section(section: Section, width_mm: float) -> None:
    called = _called(0.9, 0.3)
    found = _measured(called, [_cloud(n, 0.6, section=section) for n in range(5)])
    assert found.height_mm.value == pytest.approx(0.6, abs=0.04)
    assert found.height_mm.sigma < 0.06
    assert found.width_mm.value == pytest.approx(width_mm, abs=0.2)
    area = 0.6 * float(np.trapezoid(section(np.linspace(-1, 1, 401)), np.linspace(-1, 1, 401)))
    assert found.area_mm2.value == pytest.approx(area, rel=0.12)
    assert found.volume_mm3.value == pytest.approx(found.area_mm2.value * found.length_mm.value)


def test_each_look_may_see_one_flank_only() -> None:
    called = _called(0.5, 0.4)
    looks = [_cloud(n, 1.4, section=_triangle, flank=1 if n % 2 else -1) for n in range(4)]
    found = _measured(called, looks)
    assert found.height_mm.value == pytest.approx(1.4, abs=0.08)


@pytest.mark.study
def test_what_a_look_errs_by_is_shared_by_its_vertices() -> None:
    """Looks that make 10 % more or less of heights: four are known to 5 %, not to the fit's 1 %."""
    pulls = []
    for trial in range(24):
        rng = np.random.default_rng(100 + trial)
        looks = [
            _cloud(10 * trial + n, 0.8, section=_triangle, scale=1.0 + 0.1 * rng.normal()) for n in range(4)
        ]
        called = _called(0.8, 30.0)  # which says nothing
        found = _measured(called, looks)
        pulls.append((found.height_mm.value - 0.8) / found.height_mm.sigma)
    # 24 pulls of a jackknife over four looks, which is Student's with three degrees of freedom: its
    # median size is 0.76, with a deviation of 0.17 for 24; the fit alone would state a fifth as much
    assert 0.76 - 3.0 * 0.17 < np.median(np.abs(pulls)) < 0.76 + 3.0 * 0.17


@pytest.mark.parametrize("downwards", [False, True])
def test_the_middle_of_a_burr_is_between_all_looks_rows(*, downwards: bool) -> None:
    """A call that is 0.4 mm off across, and says so; the burr is turned to where the looks see it."""
    called = replace(burr(across_mm=0.4), angle_deg=Value(float(np.degrees(0.4 / RADIUS_MM)), 0.3))
    if downwards:  # its line has no sense
        called = replace(called, T_mesh_burr=_pose(called) @ np.diag([-1.0, -1.0, 1.0, 1.0]))
    found = _measured(called, [_cloud(n, 0.8, section=_triangle) for n in range(5)])
    assert found.angle_deg.value * np.radians(RADIUS_MM) == pytest.approx(0.0, abs=0.03)
    assert found.angle_deg.sigma * np.radians(RADIUS_MM) < 0.1
    assert np.degrees(np.arctan2(*found.T_mesh_burr[1::-1, 3])) == pytest.approx(found.angle_deg.value)


def test_a_ridge_on_an_end_face_is_measured_like_one_on_the_outside() -> None:
    """Radial at 60 mm, the face at z = 30 mm: it runs along the generatrix, and nowhere along the axis."""
    looks = []
    for cloud in (_cloud(n, 0.8, section=_triangle) for n in range(4)):
        x, y, z = cloud.points_mm.T
        across, lift = RADIUS_MM * np.arctan2(y, x), np.hypot(x, y) - RADIUS_MM
        turn, r = across / 60.0, z + 40.0
        looks.append(cloud._replace(points_mm=np.stack([r * np.cos(turn), r * np.sin(turn), 30.0 + lift], 1)))
    called = _called(0.5, 0.4)
    pose = np.eye(4)
    pose[:3, 3] = 60.0, 0.0, 30.0
    found = _measured(replace(called, T_mesh_burr=pose), looks, pose)
    assert found.height_mm.value == pytest.approx(0.8, abs=0.05)
    assert np.isfinite(found.T_mesh_burr).all()
    assert found.angle_deg.value == pytest.approx(0.0, abs=0.05)


@pytest.mark.study
def test_what_all_looks_share_is_in_what_is_stated() -> None:
    """Looks that agree to a hair: no section is a triangle to better than 2 %, and nicks light themselves."""
    looks = [_cloud(n, 0.8, section=_triangle) for n in range(8)]
    called = _called(0.8, 30.0)
    sigma = _measured(called, looks).height_mm.sigma
    assert 0.02 * 0.8 <= sigma < 0.05
    nick = replace(called, side="nick")
    assert _measured(nick, _dented(looks)).height_mm.sigma > 3.0 * sigma


def test_rows_of_several_looks_resolve_a_burr_hardly_wider_than_a_pixel() -> None:
    """0.9 mm wide at half a millimetre a pixel: eight looks show it to 3 %, as one row in sixteen would."""
    narrow = [_cloud(n, 0.8, section=lambda across: _triangle(across * 1.6 / 0.9)) for n in range(8)]
    called = _called(0.5, 0.4)
    found = _measured(called, narrow)
    assert found.width_mm.value == pytest.approx(0.9, abs=0.12)
    assert found.height_mm.value == pytest.approx(0.8, abs=0.08)


def test_what_was_called_keeps_its_weight() -> None:
    looks = [_cloud(n, 0.8, section=_triangle) for n in range(3)]
    sure = _called(0.7, 0.001)
    assert _measured(sure, looks).height_mm.value == pytest.approx(0.7, abs=0.005)


def test_one_look_and_a_burr_around_the_axis_stay_as_they_are() -> None:
    called = _called(0.7, 0.1)
    assert together(called, _pose(called), [_cloud(0, 0.8)]) is None
    away = _cloud(1, 0.8)
    turned = away.points_mm * [-1.0, -1.0, 1.0]
    assert together(called, _pose(called), [_cloud(0, 0.8), away._replace(points_mm=turned)]) is None
    around = _pose(called)
    around[:3, :3] = np.stack([-around[:3, 1], around[:3, 0], around[:3, 2]], axis=1)
    assert together(called, around, [_cloud(n, 0.8) for n in range(3)]) is None


@pytest.mark.parametrize("side", ["protrusion", "nick"])
def test_the_vertices_of_all_looks_tell_a_side_that_calls_mistook(side: str) -> None:
    """Two looks that face it call the other side; four measured 0.43 mm. Nothing is left of the calls."""
    looks = [_cloud(n, 0.43) for n in range(4)]
    if side == "nick":
        looks = _dented(looks)
    mistaken = replace(_called(0.6, 0.001), side="nick" if side == "protrusion" else "protrusion")
    votes = 2.0 * np.log(0.99 / 0.01) * mistaken.sign
    shown = sided(mistaken, votes, sides(mistaken, _pose(mistaken), looks))
    assert shown is not None
    assert shown.burr.side == side
    found = sized(shown, axis(), _pose(mistaken))
    assert found.side == side
    assert found.height_mm.value == pytest.approx(0.43, abs=0.04)
    assert found.width_mm.value == pytest.approx(_WIDTH_MM, abs=0.25)
    assert 0.999 * shown.sigma[1] < found.height_mm.sigma < 0.25


def test_a_side_stays_where_the_vertices_show_none() -> None:
    """Flat metal: the side of the calls. What rises a little is outvoted by clear calls only."""
    flat = [_cloud(n, 0.0) for n in range(4)]
    for side, sign in (("protrusion", 1.0), ("nick", -1.0)):
        called = replace(_called(0.5, 0.2), side=side)  # type: ignore[arg-type]
        shown = sided(called, 9.0 * sign, sides(called, _pose(called), flat))
        assert shown is None or shown.burr.side == side
    called = replace(_called(0.3, 0.1), side="nick")
    uneven = [_cloud(n, 0.2, scale=scale) for n, scale in enumerate((1.6, 0.0, -0.4, 1.2))]
    faint = together(replace(called, side="protrusion"), _pose(called), uneven)
    assert faint is not None
    assert 0.3 < faint.log_odds < 6.0
    kept, turned = (sided(called, votes, sides(called, _pose(called), uneven)) for votes in (-9.0, -0.1))
    assert kept is None or kept.burr.side == "nick"
    assert turned is not None
    assert turned.burr.side == "protrusion"


def test_the_odds_of_a_height_are_students() -> None:
    """Of three looks: twice the deviation has (1 + 4 / 2)^1.5 times the density that it has of no height."""
    shown = together(_called(0.5, 0.2), _pose(_called(0.5, 0.2)), [_cloud(n, 0.8) for n in range(3)])
    assert shown is not None
    twice = shown._replace(values=np.array([0.0, 2.0, 1.0, 1.0]), sigma=np.ones(4), looks=3)
    assert twice.log_odds == pytest.approx(1.5 * np.log(3.0))
    assert twice._replace(values=-twice.values).log_odds == 0.0


@pytest.mark.parametrize("turned", [False, True])
def test_places_on_a_line_are_found_along_and_across_it(*, turned: bool) -> None:
    pose = _pose(burr(70.0))
    if turned:
        pose[:3, :3] = np.stack([-pose[:3, 1], pose[:3, 0], pose[:3, 2]], axis=1)
    along, across = np.linspace(-30.0, 30.0, 7), np.linspace(-4.0, 4.0, 7)
    local = beside(pose, walked(pose, along, across))
    np.testing.assert_allclose(local[:, 0], along, atol=1e-9)
    np.testing.assert_allclose(local[:, 1], across, atol=1e-9)
