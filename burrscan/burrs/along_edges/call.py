"""Burrs that light and odd depths along the edges of a scan tell, where its depths tell none."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from burrscan.arrays import Floats
from burrscan.axis.basis import T_part_mesh
from burrscan.burrs.along_edges.boxes import Box, boxes
from burrscan.burrs.along_edges.strips import REACH, Strip, strips
from burrscan.burrs.along_edges.unexplained import odd_depths, unexplained
from burrscan.burrs.height import volume
from burrscan.burrs.pose import pose_on_surface, share_around
from burrscan.generatrix.deviation import deviation_mm
from burrscan.generatrix.polyline import Polyline, polyline_of, revolved
from burrscan.inspection import Axis, Burr, Generatrix, Value
from burrscan.pose import placed
from burrscan.sight import Sight
from burrscan.turns import turn_deg

_OF_BAND, _OF_BAND_SIGMA = 0.55, 0.3
"""A burr's height over what is odd across its edge, of 28 rendered ones: 0.14 to 0.98."""
_SAME_PX, _SAME = 3.0, 0.2
"""Two boxes that share this share of their pixels, to so many, are one place, seen along two edges."""
_STEP, _GRAZED = 0.5, 3.0
"""Pixels between the places of the curve that are looked at; how much longer one is on a grazed face."""
_BESIDE_MM = 5.0
"""Along the axis, from an edge to the middle of a burr already called there: the highest of a scan's."""
_BESIDE = np.radians(3.0)
"""Around the axis, beyond the extent of a burr already called."""


def along_edges(sight: Sight, axis: Axis, generatrix: Generatrix, *, called: Sequence[Burr]) -> list[Burr]:
    """Burrs on convex edges and open ends that run along them, other than those already ``called``.

    Where a burr stands on an edge its flanks are dark or mirror the wheel, and pixels that see them have odd
    depths or none. From one view nothing tells more of its height than how many pixels it is wide, and its σ
    says so. What is missing from an edge has depths, which tell it.

    O(pixels near edges).
    """
    found: list[Box] = []
    line = polyline_of(generatrix)
    for strip in strips(sight, axis, line):
        light = np.asarray(sight.radiance[strip.row, strip.column], np.float64)
        odd = odd_depths(strip, _deviation(sight, strip, axis, generatrix))
        found += boxes(strip, unexplained(strip, light), odd)
    burrs = []
    for box in _apart(found):
        burr = _burr(box, sight, axis, line)
        if not any(_same(burr, other, axis) for other in called):
            burrs.append(burr)
    return burrs


def _deviation(sight: Sight, strip: Strip, axis: Axis, generatrix: Generatrix) -> Floats:
    """(P,) deviation of a strip's points from the ideal surface, mm, NaN where there are none."""
    points = sight.points_mm[strip.row, strip.column]
    known = np.isfinite(points).all(axis=1)
    deviation = np.full(len(points), np.nan)
    deviation[known] = deviation_mm(points[known], axis, generatrix)
    return deviation


def _apart(found: list[Box]) -> list[Box]:
    """The clearest box of each place."""
    kept: list[Box] = []
    trees: list[cKDTree] = []
    for box in sorted(found, key=lambda box: -box.clear):
        pixels = np.stack([box.strip.row, box.strip.column], axis=1)[box.on]
        if all(np.mean(tree.query(pixels)[0] < _SAME_PX) < _SAME for tree in trees):
            kept.append(box)
            trees.append(cKDTree(pixels))
    return kept


def _burr(box: Box, sight: Sight, axis: Axis, line: Polyline) -> Burr:
    strip, radius = box.strip, float(box.strip.place[1])
    low, high = float(strip.angle[box.on].min()), float(strip.angle[box.on].max())
    band = box.rows * strip.pixel_mm
    feet = _feet(box, sight, axis, line)
    half = 0.5 * strip.pixel_mm
    z = feet[:, 0]
    height = Value(_OF_BAND * band, _OF_BAND_SIGMA * band)
    width = Value(band, band / np.sqrt(12.0))
    length = Value((high - low) * radius + strip.pixel_mm, strip.pixel_mm)  # pixels reach half on
    area = Value(0.5 * height.value * band, 0.5 * height.sigma * band)
    return Burr(
        side="protrusion",
        angle_deg=Value(
            turn_deg(float(np.degrees(0.5 * (low + high)))), float(np.degrees(strip.pixel_mm / radius))
        ),
        z_start_mm=Value(float(z.min()) - half, 0.5 * band),
        z_end_mm=Value(float(z.max()) + half, 0.5 * band),
        height_mm=height,
        width_mm=width,
        length_mm=length,
        area_mm2=area,
        volume_mm3=volume(area, length),
        T_mesh_burr=pose_on_surface(
            feet.mean(axis=0), strip.normal, 0.5 * (low + high), np.array([1.0, 0.0]), axis
        ),
        significance=box.clear,
    )


def _feet(box: Box, sight: Sight, axis: Axis, line: Polyline) -> Floats:
    """(N, 2) places (z, r) of the ideal surface beside an edge that a stretch's pixels look at.

    A burr that stands up hides them.
    """
    strip = box.strip
    pieces = np.ceil(line.lengths_mm / (_STEP * strip.pixel_mm)).astype(np.int64) + 1
    segment = np.repeat(np.arange(len(pieces)), pieces)
    share = np.concatenate([np.linspace(0.0, 1.0, number) for number in pieces])
    places = line.places_mm(segment, share)
    places = places[np.linalg.norm(places - strip.place, axis=1) < REACH * strip.pixel_mm * _GRAZED]
    middle = 0.5 * (strip.angle[box.on].min() + strip.angle[box.on].max())
    points = revolved(places, np.array([middle])).reshape(-1, 3)
    T_camera_part = np.linalg.inv(T_part_mesh(axis.point_mm, axis.direction))
    seen = sight.rig.camera.project(placed(T_camera_part, points))
    pixels = np.stack([strip.column, strip.row], axis=1)[box.on]
    on = np.asarray(cKDTree(pixels).query(seen)[0] < 1.0)
    return places[on] if on.any() else strip.place[None]


def _same(burr: Burr, other: Burr, axis: Axis) -> bool:
    """Whether a burr along an edge is at the place of another, of either side."""
    T_part = T_part_mesh(axis.point_mm, axis.direction)
    one, two = (placed(T_part, each.T_mesh_burr[None, :3, 3])[0] for each in (burr, other))
    radius = max(float(np.hypot(one[0], one[1])), 1e-9)
    turn = np.arctan2(one[0] * two[1] - one[1] * two[0], one[0] * two[0] + one[1] * two[1])
    reach = sum(_around_mm(each, axis) for each in (burr, other)) / radius + _BESIDE
    between = other.z_start_mm.value - _BESIDE_MM, other.z_end_mm.value + _BESIDE_MM
    return bool(abs(turn) < reach and between[0] < one[2] < between[1])


def _around_mm(burr: Burr, axis: Axis) -> float:
    """Half of what a burr reaches around the axis."""
    share = share_around(burr, axis)
    width = float(np.nan_to_num(burr.width_mm.value))
    return 0.5 * float(np.hypot(burr.length_mm.value * share, width * np.sqrt(max(1.0 - share**2, 0.0))))
