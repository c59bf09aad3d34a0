"""Which edges of a curve are looked at, and what pixels beside them are where."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from burrscan.arrays import Floats
from burrscan.axis.basis import T_part_mesh
from burrscan.burrs.along_edges.strips import REACH, Strip, strips
from burrscan.burrs.along_edges.unexplained import odd_depths, unexplained
from burrscan.generatrix.polyline import Polyline, join
from tests.burrscan.burrs.light.scene import Scene

_SEEN_FROM_ITS_END = (0.2, 0.5, -1.0)


def _line(*nodes_zr: tuple[float, float]) -> Polyline:
    return join([np.array(nodes_zr)])


def _places(scene: Scene, line: Polyline) -> list[tuple[float, float]]:
    found = strips(scene.sight(), scene.axis, line)
    return sorted((round(float(z)), round(float(r))) for z, r in (strip.place for strip in found))


def test_convex_corners_and_open_ends_that_are_seen_are_edges() -> None:
    """A collar: its shoulder's outer corner is an edge, its root none; its far end lies deeper than seen."""
    scene = Scene()
    collar = _line((-50.0, 90.0), (0.0, 90.0), (0.0, 83.0), (50.0, 83.0))
    assert _places(scene, collar) == [(-50, 90), (0, 90)]
    assert _places(scene, _line((-50.0, 90.0), (50.0, 90.0))) == [(-50, 90), (50, 90)]


def test_a_root_is_no_edge() -> None:
    """The same shoulder seen from the other side of its curve: a groove's wall down to what is measured."""
    groove = _line((-50.0, 97.0), (0.0, 97.0), (0.0, 90.0), (50.0, 90.0))
    assert _places(Scene(), groove) == [(50, 90)]


def test_a_closed_curve_has_no_ends() -> None:
    ring = _line((-50.0, 90.0), (50.0, 90.0), (50.0, 60.0), (-50.0, 60.0), (-50.0, 90.0))
    assert _places(Scene(), ring) == [(50, 90)]  # where a closed curve begins is none, if it is a corner


@pytest.mark.parametrize("direction", [(0.0, 1.0, 0.0), (0.2, 1.0, 0.1)])
def test_pixels_lie_on_the_face_and_where_they_are_said_to_be(direction: tuple[float, float, float]) -> None:
    scene = Scene(direction=direction)
    half = len(scene.points) // 2
    for strip in strips(scene.sight(), scene.axis, _full(scene)):
        assert np.all(scene.on[strip.row, strip.column] | (np.abs(strip.off_px) < 1.0))
        assert np.abs(strip.off_px).max() <= REACH + 1.0
        on = scene.on[strip.row, strip.column]
        points = scene.points[strip.row, strip.column][on]
        part = points @ T_part_mesh(scene.axis.point_mm, scene.axis.direction)[:3, :3].T
        part = part + T_part_mesh(scene.axis.point_mm, scene.axis.direction)[:3, 3]
        turn = np.arctan2(part[:, 1], part[:, 0]) - strip.angle[on]
        assert np.abs((turn + np.pi) % (2.0 * np.pi) - np.pi).max() * scene.radius_mm < 10.0
        from_edge = np.abs(part[:, 2] - strip.place[0])
        assert np.corrcoef(from_edge, np.abs(strip.off_px[on]))[0, 1] > 0.95
        mirrored = strip.from_mirror[np.argsort(strip.arc_px)]
        assert mirrored[:half].mean() * mirrored[-half:].mean() < 0.0  # the mirror's place lies between


def test_an_edge_is_looked_at_as_far_as_the_projector_lights_it() -> None:
    """A narrow one: beyond the border of its picture it is as dark as beside a burr."""
    scene, whole = Scene(), []
    for share in (1.0, 0.4):
        one = scene.rig.projector
        narrow = replace(one, width=int(share * one.width), cx=one.cx - 0.5 * (1.0 - share) * one.width)
        scene.rig = replace(scene.rig, projector=narrow)
        whole.append(strips(scene.sight(), scene.axis, _full(scene)))
        for strip in whole[-1]:
            points = scene.points[strip.row, strip.column]
            x = scene.rig.correspond(points[np.isfinite(points).all(axis=1)])[:, 0]
            assert x.min() > 0.0
            assert x.max() < narrow.width - 1.0
    assert 500 < sum(len(strip.row) for strip in whole[1]) < 0.8 * sum(len(strip.row) for strip in whole[0])


@pytest.mark.parametrize(("length_mm", "least_px", "most_px"), [(2.0, 1.0, 2.6), (40.0, 7.0, REACH + 1.0)])
def test_beyond_where_a_face_ends_nothing_is_looked_at(
    length_mm: float, least_px: float, most_px: float
) -> None:
    """A groove was seen past a face of which the rounding only was measured, and its light was odd."""
    off = _shoulder(Scene(direction=_SEEN_FROM_ITS_END), length_mm).off_px
    shoulder, side = sorted([-off.min(), off.max()])
    assert least_px < shoulder < most_px  # a pixel is 0.89 mm
    assert side == pytest.approx(REACH, abs=1.0)


def test_a_rounding_misses_the_mirror_by_the_angle_of_its_nearest_normal() -> None:
    """Seen from the end a glint reaches far around the axis: its width there is no lobe's."""
    scene = Scene(direction=_SEEN_FROM_ITS_END)
    eye, lamp = scene.rig.centres_mm(T_part_mesh(scene.axis.point_mm, scene.axis.direction))
    strip = _shoulder(scene, 40.0)
    some = np.arange(0, len(strip.angle), 97)
    cos, sin = np.cos(strip.angle[some]), np.sin(strip.angle[some])
    place = np.stack([90.0 * cos, 90.0 * sin, np.full(len(some), strip.place[0])], axis=1)
    to = [each - place for each in (eye, lamp)]
    half = sum(each / np.linalg.norm(each, axis=1, keepdims=True) for each in to)
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    tilt = np.linspace(0.0, 0.5 * np.pi, 2001)[:, None]
    normals = np.stack([np.sin(tilt) * cos, np.sin(tilt) * sin, np.cos(tilt) * np.ones(len(some))], axis=2)
    missed = np.arccos(np.clip((normals * half).sum(axis=2), -1.0, 1.0)).min(axis=0)
    assert np.abs(strip.from_mirror[some]) == pytest.approx(missed, abs=0.002)
    assert np.ptp(strip.angle) > 2.0 * np.ptp(strip.from_mirror)


def _shoulder(scene: Scene, length_mm: float) -> Strip:
    """The edge of a shoulder halfway up the cylinder, which the camera sees."""
    z = float(scene.generatrix.z_mm.mean())
    curve = _line((z - 50.0, 90.0), (z, 90.0), (z, 90.0 - length_mm))
    return next(one for one in strips(scene.sight(), scene.axis, curve) if abs(one.place[0] - z) < 2.0)


def _full(scene: Scene) -> Polyline:
    return _line(*np.stack([scene.generatrix.z_mm, scene.generatrix.r_mm], axis=1).tolist())


def test_light_that_faces_explain_leaves_nothing_and_what_they_do_not_is_left() -> None:
    scene = Scene(light_noise=0.0)
    strip = strips(scene.sight(), scene.axis, _full(scene))[-1]
    on = scene.on[strip.row, strip.column]
    light = np.where(on, np.exp(scene.log_light[strip.row, strip.column]), 0.0)
    rest = unexplained(strip, light)
    assert np.nanquantile(np.abs(rest[on & (np.abs(strip.off_px) > 1.0)]), 0.9) < 0.02
    stretch = (np.abs(strip.arc_px - 60.0) < 10.0) & on & (np.abs(strip.off_px) < 3.0)
    assert np.nanmedian(unexplained(strip, light * np.where(stretch, 0.5, 1.0))[stretch]) == pytest.approx(
        -0.5, abs=0.05
    )


def test_where_the_faces_are_dark_nothing_is_known() -> None:
    scene = Scene()
    strip = strips(scene.sight(), scene.axis, _full(scene))[-1]
    dark = strip.arc_px > 130.0
    light = np.exp(scene.log_light[strip.row, strip.column]) * np.where(dark, 1e-4, 1.0)
    rest = unexplained(strip, light)
    assert np.isnan(rest[strip.arc_px > 140.0]).all()
    assert np.isfinite(rest[(strip.arc_px < 120.0) & (np.abs(strip.off_px - 4.0) < 2.0)]).mean() > 0.9


def test_where_the_light_of_the_faces_is_noise_nothing_is_known() -> None:
    """Of an end face in the dark: noise has steps, and of a thousand places some are a burr's."""
    scene = Scene(light_noise=0.02)
    strip = strips(scene.sight(), scene.axis, _full(scene))[-1]
    light = np.exp(scene.log_light[strip.row, strip.column])
    dark = strip.arc_px > 100.0
    light *= np.where(dark, 1.0 + 0.4 * np.random.default_rng(2).normal(size=len(light)), 1.0)
    rest = unexplained(strip, np.maximum(light, 0.0))
    assert np.isnan(rest[strip.arc_px > 120.0]).mean() > 0.98
    assert np.isfinite(rest[(strip.arc_px < 80.0) & (np.abs(strip.off_px - 4.0) < 2.0)]).mean() > 0.9


def test_a_glint_is_explained_and_its_opposite_is_not() -> None:
    scene = Scene(light_noise=0.0)
    strip = strips(scene.sight(), scene.axis, _full(scene))[-1]
    light = np.exp(scene.log_light[strip.row, strip.column])
    shape = np.exp(-0.5 * (strip.from_mirror / np.radians(6.0)) ** 2) * (np.abs(strip.off_px) < 2.0)
    middle = (shape > 0.8) & (np.abs(strip.off_px) < 1.5)
    assert np.nanmax(np.abs(unexplained(strip, light * (1.0 + shape))[middle])) < 0.1
    assert np.nanmedian(unexplained(strip, light * (1.0 - 0.7 * shape))[middle]) < -0.3


def test_of_a_glint_as_large_a_share_is_left_as_of_the_faces() -> None:
    scene = Scene(light_noise=0.0)
    strip = strips(scene.sight(), scene.axis, _full(scene))[-1]
    light = np.exp(scene.log_light[strip.row, strip.column])
    shape = np.exp(-0.5 * (strip.from_mirror / np.radians(8.0)) ** 2) * (np.abs(strip.off_px) < 2.0)
    noise = 1.0 + 0.1 * np.random.default_rng(3).normal(size=len(light))
    rest = unexplained(strip, light * (1.0 + 20.0 * shape) * noise)
    for near in (shape > 0.8, (shape < 0.05) & (np.abs(strip.off_px) < 1.5)):
        assert np.nanstd(rest[near]) == pytest.approx(0.1, rel=0.3)


def test_odd_are_depths_that_miss_or_are_far_off_their_row() -> None:
    scene = Scene()
    strip = strips(scene.sight(), scene.axis, _full(scene))[-1]
    rng = np.random.default_rng(1)
    deviation: Floats = 0.1 * np.floor(strip.off_px) + 0.02 * rng.normal(size=len(strip.row))
    high, low, missing, usual = np.split(rng.permutation(len(strip.row)), [40, 80, 120])
    deviation[high] += 0.3
    deviation[low] -= 0.3
    deviation[missing] = np.nan
    odd = odd_depths(strip, deviation)
    assert min(odd[each].mean() for each in (high, low, missing)) > 0.95
    assert odd[usual].mean() < 0.01


@pytest.mark.parametrize("direction", [(0.0, 1.0, 0.0), (0.0, 1.0, 0.6)])
def test_a_pixel_is_as_large_however_the_axis_leans(direction: tuple[float, float, float]) -> None:
    """The part frame begins where the axis is nearest to the camera, which may be far above the wheel."""
    scene = Scene(direction=direction)
    expected = np.linalg.norm(scene.middle_mm) / scene.rig.camera.fx
    found = strips(scene.sight(), scene.axis, _full(scene))
    assert found
    assert [strip.pixel_mm for strip in found] == pytest.approx([expected] * len(found), rel=1e-6)
