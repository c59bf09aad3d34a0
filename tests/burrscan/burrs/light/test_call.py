"""Disturbed places as burrs: where, how long, how high and how sure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from burrscan.axis.basis import T_part_mesh
from burrscan.burrs.height import combined, judged
from burrscan.burrs.light.call import around, belongs, called, doubted, placed
from burrscan.burrs.light.disturbed import Place, disturbed
from burrscan.burrs.light.side import Told
from burrscan.burrs.light.unrolled import Unrolled
from burrscan.inspection import Burr, Value
from tests.burrscan.burrs.light.scene import Scene, bright_line, dark_line
from tests.burrscan.burrs.light.test_disturbed import LEANING
from tests.burrscan.parts import turned


def seen(
    scene: Scene, *, widest_mm: float = 3.0, limit_mm: float | None = None
) -> tuple[Unrolled, Place, Burr]:
    surface, _, (place,) = disturbed(scene.sight(), scene.axis, scene.generatrix, widest_mm=widest_mm)
    return surface, place, judged(called(place, surface, scene.axis), limit_mm)


@pytest.mark.parametrize("direction", LEANING)
def test_a_dark_line_is_a_burr_at_its_place(direction: tuple[float, float, float]) -> None:
    scene = Scene(direction)
    dark_line(scene, at=(12.0, -15.0, 12.0))
    _, _, burr = seen(scene)
    middle = scene.place_mm(12.0, -1.5)
    part = scene.in_part(middle)
    assert burr.side == "protrusion"
    assert abs(turned(burr.angle_deg.value - np.degrees(np.arctan2(part[1], part[0])))) < 0.4
    assert (
        abs(turned(burr.angle_deg.value - np.degrees(np.arctan2(part[1], part[0]))))
        < 3.0 * burr.angle_deg.sigma
    )
    assert burr.z_start_mm.value == pytest.approx(part[2] - 13.5, abs=1.5)
    assert burr.z_end_mm.value == pytest.approx(part[2] + 13.5, abs=1.5)
    assert burr.length_mm.value == pytest.approx(27.0, abs=2.0)
    assert burr.width_mm.value == pytest.approx(3.0, abs=0.9)
    # the pose: on the surface, x along the axis, z outwards; one place with the angle
    pose = burr.T_mesh_burr
    assert np.linalg.norm(pose[:3, 3] - middle) < 1.5
    out = middle - np.asarray(scene.middle_mm) + 1.5 * scene.axis.direction
    assert pose[:3, 2] @ out / np.linalg.norm(out) > 0.9999
    assert abs(pose[:3, 0] @ scene.axis.direction) > 0.9999
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)
    T = T_part_mesh(scene.axis.point_mm, scene.axis.direction)
    origin = T[:3, :3] @ pose[:3, 3] + T[:3, 3]
    assert np.degrees(np.arctan2(origin[1], origin[0])) == pytest.approx(burr.angle_deg.value, abs=1e-9)
    assert burr.z_start_mm.value <= origin[2] <= burr.z_end_mm.value


def test_a_bright_line_below_is_a_nick() -> None:
    scene = Scene()
    bright_line(scene)
    _, _, burr = seen(scene)
    assert burr.side == "nick"
    part = scene.in_part(scene.place_mm(-25.0, 5.0))
    assert abs(turned(burr.angle_deg.value - np.degrees(np.arctan2(part[1], part[0])))) < 0.4


def test_the_limit_is_judged_by_the_height_told() -> None:
    scene = Scene()
    dark_line(scene)
    height = seen(scene)[2].height_mm.value
    assert [seen(scene, limit_mm=limit)[2].within_limit for limit in (0.9 * height, 1.1 * height, None)] == [
        False,
        True,
        None,
    ]


@pytest.mark.study
def test_the_height_told_by_a_width_is_as_sure_as_stated() -> None:
    """Heights are drawn; the base is 0.5 to 2 of them, a third of them hides: widths follow.

    The lines are painted: they show no flank, and what the model of a burr's light tells of them may be no
    worse than what their width tells.
    """
    rng = np.random.default_rng(11)
    pulls, modelled = list[float](), list[float]()
    for seed in range(30):
        per_width = rng.uniform(0.43, 1.0)  # 1 / (base + 1/3), by which the constant is argued, evenly spread
        height = rng.uniform(1.5, 5.0)
        scene = Scene(seed=seed)
        dark_line(scene, height / per_width, at=(rng.uniform(-20.0, 25.0), -15.0, 12.0))
        surface, _, places = disturbed(scene.sight(), scene.axis, scene.generatrix, widest_mm=12.0)
        assert places[0].told is not None
        for place, found in ((replace(places[0], told=None), pulls), (places[0], modelled)):
            told = called(place, surface, scene.axis).height_mm
            found.append((told.value - height) / told.sigma)
    # 30 pulls: the mean is known to 0.18, the root mean square to 13 %
    assert abs(np.mean(pulls)) < 0.5
    assert 0.7 < np.sqrt(np.mean(np.square(pulls))) < 1.35
    assert np.abs(pulls).max() < 3.5
    assert abs(np.mean(modelled)) < 0.5
    assert np.sqrt(np.mean(np.square(modelled))) < 1.35


def test_depths_below_what_the_light_lets_expect_have_their_weight() -> None:
    """Light that bounces looks farther off the surface; and holes leave open what hides there.

    Of a triangle a fifth of the depths are beyond four fifths of its height.
    """
    scene = Scene()
    bright_line(scene, at=(-15.0, -10.0, 20.0))
    surface, _, (place,) = disturbed(scene.sight(), scene.axis, scene.generatrix, widest_mm=3.0)
    seen_mm = place.seen_mm(place.side)
    assert seen_mm == pytest.approx(0.4, abs=0.05)
    told = called(replace(place, floor_mm=np.nan), surface, scene.axis).height_mm
    assert told.value > 1.2 * seen_mm
    low = called(place, surface, scene.axis).height_mm
    shown = Value(seen_mm / 0.8, 0.3 * seen_mm / 0.8)
    assert (low.value, low.sigma) == pytest.approx((combined(shown, told).value, combined(shown, told).sigma))
    for other in (
        replace(place, floor_mm=1.01 * told.value),
        replace(place, unmeasured=(place.above + place.below) // 5),
    ):
        assert called(other, surface, scene.axis).height_mm == told
    # lit from aside a wall shows a part of itself: the light tells as well, and the more the more it is so
    lower = replace(place, floor_mm=0.3)
    fully, half, aside = (
        called(replace(lower, lit=lit), surface, scene.axis).height_mm for lit in (0.0, 0.5, 1.0)
    )
    assert fully.value < half.value < aside.value < told.value
    assert fully.sigma < half.sigma < aside.sigma


def test_a_burr_belongs_to_the_place_it_stands_at() -> None:
    scene = Scene()
    dark_line(scene)
    surface, place, burr = seen(scene)
    assert belongs(burr, place, surface)
    middle = float(np.degrees(surface.angle[np.nonzero(place.cells)[1]].mean()))
    wide, far, narrow = np.degrees(3.0 / 90.0), np.degrees(12.0 / 90.0), 0.2
    for shift, width, expected in (
        (wide, narrow, True),
        (far, narrow, False),
        (-far, narrow, False),
        (far, 24.0, True),
    ):
        angle = Value(turned(middle + shift), 0.1)
        assert belongs(_like(burr, angle_deg=angle, width_mm=Value(width, 0.1)), place, surface) is expected
    for shift, expected in ((20.0, True), (40.0, False), (-40.0, False)):
        ends = {name: Value(getattr(burr, name).value + shift, 0.1) for name in ("z_start_mm", "z_end_mm")}
        assert belongs(_like(burr, **ends), place, surface) is expected
    assert belongs(_like(burr, width_mm=Value(np.nan, np.nan)), place, surface)


def _like(burr: Burr, **values: Value) -> Burr:
    return replace(burr, **values)  # type: ignore[arg-type]


def _one_deep(place: Place, *, sigma: float = 0.2) -> Place:
    """A place of which the light tells a nick 1 mm deep, to a share of that."""
    widths, aspects = np.geomspace(1.0, 3.0, 12), np.geomspace(0.06, 2.4, 40)
    misfits = np.log(widths[:, None] * aspects) ** 2 / sigma**2
    nowhere = np.zeros(2), np.zeros((2, 2))
    return replace(place, told=Told(widths, aspects, np.stack([misfits + 50.0, misfits]), *nowhere))


def test_a_height_at_a_place_with_holes_is_doubted() -> None:
    scene = Scene()
    dark_line(scene)
    surface, place, burr = seen(scene)
    place, burr = _one_deep(place), replace(burr, side="nick")
    told = called(place, surface, scene.axis).height_mm
    share = place.unmeasured / (place.above + place.below + place.unmeasured)
    assert share > 0.5
    # one that contradicts the width takes the height that the width tells; one that agrees keeps its own
    for value in (told.value - 2.1 * told.sigma, told.value + 2.1 * told.sigma):
        again = doubted(_like(burr, height_mm=Value(value, 0.01)), place, surface)
        assert again.height_mm == told
    value = told.value + 1.5 * told.sigma
    deep = _like(burr, height_mm=Value(value, 0.01))
    alone = doubted(deep, replace(place, told=None), surface).height_mm
    assert alone.value == value
    told_by_width = called(replace(place, told=None), surface, scene.axis).height_mm
    assert alone.sigma == pytest.approx(np.hypot(0.01, share * told_by_width.sigma))
    # two that know nothing of each other, of errors share * sigma and sigma, and 1.5 sigma apart
    both = doubted(deep, place, surface).height_mm
    assert (both.value - told.value) / told.sigma == pytest.approx(1.5 / (1.0 + share**2), rel=0.01)
    each, between = share**2 / (1.0 + share**2), (1.5 * share / (1.0 + share**2)) ** 2
    assert both.sigma / told.sigma == pytest.approx(np.sqrt(each + between), rel=0.01)


def test_a_height_that_the_light_rules_out_is_doubted_however_little_is_told() -> None:
    """A ridge 1.92 mm high, a quarter of it without depth, was told 1.35 ± 0.67 and stated 0.18 ± 0.36."""
    scene = Scene()
    bright_line(scene, at=(-15.0, -10.0, 20.0))
    surface, place, burr = seen(scene)
    widths, aspects = np.geomspace(1.0, 3.0, 12), np.geomspace(0.06, 2.4, 40)
    misfits = np.where(widths[:, None] * aspects < 0.4, 20.0, 0.0)
    nowhere = np.zeros(2), np.zeros((2, 2))
    told = replace(place, told=Told(widths, aspects, np.stack([misfits + 50.0, misfits]), *nowhere))
    height = called(replace(told, floor_mm=np.nan), surface, scene.axis).height_mm
    assert height.value < 2.0 * height.sigma
    holes = replace(told, unmeasured=(place.above + place.below) // 3)
    low = _like(burr, height_mm=Value(0.1, 0.03))
    assert doubted(low, holes, surface).height_mm == height
    assert doubted(low, told, surface).height_mm.value < 0.2  # all of it was measured
    fair = _like(burr, height_mm=Value(0.6, 0.03))
    assert doubted(fair, holes, surface).height_mm.value < 0.8


def test_a_height_that_is_light_bounced_is_told_anew() -> None:
    """Only where it is higher than the model's, and contradicted by it: a likelihood ratio of two sigmas."""
    scene = Scene()
    bright_line(scene, at=(-15.0, -10.0, 20.0))
    surface, place, burr = seen(scene)
    assert place.unmeasured == 0
    told = _one_deep(place)
    assert told.side == -1
    for high, bounced in ((3.0, True), (1.8, True), (1.3, False), (0.3, False)):
        depth = Value(high, 0.01)
        again = doubted(_like(burr, height_mm=depth), told, surface).height_mm
        if bounced:
            assert again.value == pytest.approx(1.0, abs=0.1)
            assert 0.1 < again.sigma < 0.3
        else:  # a hundredth of a millimetre outweighs what the light tells
            assert again.value == pytest.approx(high, abs=0.01)
            assert again.sigma < 0.05
        assert doubted(_like(burr, height_mm=depth), replace(place, told=None), surface).height_mm == depth


def test_along_the_baseline_a_contradicted_height_is_what_most_of_the_place_shows() -> None:
    """What is told has its weight where it is surer than that; holes leave the depth its own."""
    scene = Scene()
    bright_line(scene, at=(-15.0, -10.0, 20.0))
    surface, place, burr = seen(scene)
    along = replace(surface, projector_mm=surface.camera_mm + np.array([0.0, 0.0, 200.0]))
    widths, aspects = np.geomspace(1.0, 3.0, 12), np.geomspace(0.06, 2.4, 40)
    heights = widths[:, None] * aspects
    nowhere = np.zeros(2), np.zeros((2, 2))

    def as_told(share: float, **values: float) -> Place:
        misfits = np.log(heights / 1.0) ** 2 / share**2  # of nicks: 1 mm deep to a share of it
        told = Told(widths, aspects, np.stack([misfits + 50.0, misfits]), *nowhere)
        return replace(place, told=told, crest_mm=0.2, floor_mm=1.3, **values)  # type: ignore[arg-type]

    deep = _like(burr, height_mm=Value(4.0, 0.3))
    vague = doubted(deep, as_told(0.4), along).height_mm
    assert (vague.value, vague.sigma) == pytest.approx((1.3, 0.3 * 1.3))
    sure = doubted(deep, as_told(0.1), along).height_mm
    assert sure.value == pytest.approx(1.0, abs=0.1)
    assert 0.05 < sure.sigma < 0.2
    holes = doubted(deep, as_told(0.1, unmeasured=place.below), along).height_mm
    nothing = doubted(deep, replace(as_told(0.1), floor_mm=np.nan), along).height_mm
    for both in (holes, nothing):
        assert sure.value < both.value < 4.0
        assert both.sigma > 0.3
    # what only a width tells is told alike whichever way the baseline lies
    blind = replace(place, told=None, unmeasured=place.below)
    assert doubted(deep, blind, along).height_mm == doubted(deep, blind, surface).height_mm
    assert doubted(deep, blind, along).height_mm.value < 2.0
    # what the light does not contradict is left to the depth, unless there are holes
    fine = _like(burr, height_mm=Value(1.2, 0.3))
    assert doubted(fine, as_told(0.1), along).height_mm == fine.height_mm
    for told, baseline in ((as_told(0.1, unmeasured=place.below), along), (as_told(0.1), surface)):
        assert doubted(fine, told, baseline).height_mm.value < 1.1
    # across it the height told is taken
    across = doubted(deep, as_told(0.4), surface).height_mm
    assert across.value < 1.25


def test_where_the_depth_decides_the_side_the_light_is_asked_for_that_side() -> None:
    """A place that leaves the side open: its ridges and nicks have heights and angles of their own."""
    scene = Scene()
    bright_line(scene, at=(-15.0, -10.0, 20.0))
    surface, place, burr = seen(scene)
    widths, aspects = np.geomspace(1.0, 3.0, 12), np.geomspace(0.06, 2.4, 40)
    heights = widths[:, None] * aspects
    misfits = np.stack([np.log(heights / size) ** 2 / 0.1**2 for size in (2.0, 0.5)])
    centres = np.radians(burr.angle_deg.value) + np.linspace(-0.05, 0.05, 11)
    at = (np.arange(11) - np.array([[8.0], [2.0]])) ** 2 / 0.25**2
    told = Told(widths, aspects, misfits, centres, at)
    high = _like(burr, height_mm=Value(5.0, 0.1), angle_deg=Value(burr.angle_deg.value, 0.1))
    for standing in (0.1, -0.1):
        open_place = replace(place, told=told, aside=standing, above=5, below=5)
        assert open_place.undecided
        for side, height, centre in (("protrusion", 2.0, 8), ("nick", 0.5, 2)):
            one = replace(high, side=side)  # type: ignore[arg-type]
            again = doubted(one, open_place, surface)
            assert again.height_mm.value == pytest.approx(height, rel=0.1)
            moved = placed(one, open_place, surface, scene.axis, mirrored=1.0)
            assert moved.angle_deg.value == pytest.approx(np.degrees(centres[centre]), abs=0.05)


def test_a_height_that_was_measured_is_believed() -> None:
    scene = Scene()
    bright_line(scene, at=(-15.0, -10.0, 20.0))
    surface, place, burr = seen(scene)
    measured = _like(burr, height_mm=Value(0.4, 0.01))
    for told in (place, replace(place, told=None)):
        height = doubted(measured, told, surface).height_mm
        assert height.value == pytest.approx(0.4, abs=0.01)
        assert height.sigma < 0.03


def test_a_height_lit_from_aside_is_that_of_a_part() -> None:
    """A nick 1.5 mm deep on brass, 68 degrees from the projector, was stated 0.17 ± 0.03 mm deep."""
    scene = Scene()
    bright_line(scene, at=(-15.0, -10.0, 20.0))
    surface, place, burr = seen(scene)
    widths, aspects = np.geomspace(1.0, 3.0, 12), np.geomspace(0.06, 2.4, 40)
    misfits = np.log(widths[:, None] * aspects / 1.2) ** 2 / 0.3**2
    nowhere = np.zeros(2), np.zeros((2, 2))
    told = replace(place, told=Told(widths, aspects, np.stack([misfits + 50.0, misfits]), *nowhere))
    shallow = _like(burr, height_mm=Value(0.17, 0.03))
    assert doubted(shallow, told, surface).height_mm.value < 0.3
    partly, fully = (doubted(shallow, replace(told, lit=lit), surface).height_mm for lit in (0.5, 1.0))
    assert 0.3 < partly.value < fully.value
    assert abs(fully.value - 1.5) < 3.0 * fully.sigma
    deep = _like(burr, height_mm=Value(1.2, 0.03))  # where both agree, they agree
    assert doubted(deep, replace(told, lit=1.0), surface).height_mm.value == pytest.approx(1.2, abs=0.1)


def test_the_ends_of_a_burr_around_the_wheel_are_its_own() -> None:
    """The light shows where an arc begins and ends: no burrs of their own, as a burr across it is."""
    scene = Scene()
    dark_line(scene)
    surface, place, burr = seen(scene)
    around_wheel = replace(
        burr,
        T_mesh_burr=burr.T_mesh_burr[:, [1, 0, 2, 3]] * [1.0, -1.0, 1.0, 1.0],
        length_mm=Value(60.0, 0.1),
        angle_deg=Value(burr.angle_deg.value + 15.0, 0.1),
    )
    assert around(around_wheel, place, surface, scene.axis)
    assert not around(burr, place, surface, scene.axis)
    narrow = replace(around_wheel, z_end_mm=replace(burr.z_start_mm, value=burr.z_start_mm.value + 1.0))
    assert not around(narrow, place, surface, scene.axis)
    far = replace(around_wheel, angle_deg=Value(burr.angle_deg.value + 60.0, 0.1))
    assert not around(far, place, surface, scene.axis)


def test_a_burr_is_where_the_light_tells() -> None:
    """Not where its depth looked high: turned about the axis; one around the wheel stays."""
    scene = Scene()
    bright_line(scene)
    surface, place, burr = seen(scene)
    assert place.told is not None
    high = _like(burr, height_mm=Value(6.0, 0.1), angle_deg=Value(burr.angle_deg.value, 0.01))
    centres = np.radians(burr.angle_deg.value) + np.linspace(-0.05, 0.05, 11)
    clear = np.tile((np.arange(11) - 8.0) ** 2 / 0.25**2, (2, 1))  # the ninth, to a quarter of a step
    told = replace(place, told=replace(place.told, centres_rad=centres, at=clear))
    moved = placed(high, told, surface, scene.axis, mirrored=1.0)
    assert moved.angle_deg.value == pytest.approx(np.degrees(centres[8]), abs=0.02)
    assert moved.angle_deg.sigma == pytest.approx(np.degrees(0.01 / np.sqrt(12.0)), rel=0.05)
    assert moved.height_mm == high.height_mm
    for one in (high, moved):
        x, y, _ = scene.in_part(one.T_mesh_burr[:3, 3])
        assert abs(turned(float(np.degrees(np.arctan2(y, x))) - one.angle_deg.value)) < 0.01
    assert placed(high, replace(place, told=None), surface, scene.axis, mirrored=1.0) is high
    across = replace(high, T_mesh_burr=high.T_mesh_burr[:, [1, 0, 2, 3]] * [1.0, -1.0, 1.0, 1.0])
    assert placed(across, told, surface, scene.axis, mirrored=1.0) is across
    # on a matt part nothing bounces, and light is off by no more than the burr is high
    assert placed(high, told, surface, scene.axis, mirrored=0.0).angle_deg == high.angle_deg
    low = placed(_like(high, height_mm=Value(0.5, 0.1)), told, surface, scene.axis, mirrored=1.0)
    assert abs(low.angle_deg.value - high.angle_deg.value) < 0.5 * np.degrees(0.03)
    # one that leans is turned to where it is told in the middle of the place, and leans as much
    lean = np.radians(10.0)
    turn = np.array([[np.cos(lean), -np.sin(lean), 0.0], [np.sin(lean), np.cos(lean), 0.0], [0.0, 0.0, 1.0]])
    pose = high.T_mesh_burr.copy()
    pose[:3, :3] = pose[:3, :3] @ turn
    pose[:3, 3] += 10.0 * pose[:3, 0]
    x, y, _ = scene.in_part(pose[:3, 3])
    leaning = replace(high, T_mesh_burr=pose, angle_deg=Value(float(np.degrees(np.arctan2(y, x))), 0.01))
    again = placed(leaning, told, surface, scene.axis, mirrored=1.0)
    back = again.T_mesh_burr[:3, 3] - 10.0 * again.T_mesh_burr[:3, 0]
    x, y, _ = scene.in_part(back)
    assert abs(turned(float(np.degrees(np.arctan2(y, x) - centres[8])))) < 0.05
