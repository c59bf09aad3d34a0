"""What of a part one pose of the scanner would show, by its shape alone, and how the light would fall."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Bools, Floats, freeze
from burrscan.cell.chart import Chart
from burrscan.pose import placed
from burrscan.rig import Rig

STEEPEST_DEG = 65.0
"""Surfaces seen or lit under more than this are not counted on: a pixel covers 2.4 times its size there."""
ASIDE_DEG = 30.0
"""Seen from farther aside, across its line, a burr hides its other flank, which is as steep as 60 degrees and
measured by what it mirrors well before: heights of such looks were two or three times too large."""
_SHOWN_DEG = (55.0, 90.0), (45.0, 75.0)
"""Up to the first, across its line, a burr is called where it is measured, from the second on not: with the
baseline along it, and across it. Of 484 rendered burrs along 0.99 were called up to 55 degrees, then 0.92,
0.69 and 0.19 in steps of ten; of 90 across all up to 45, then 0.75, 0.58, 0.17 and none (27 cells of three
wheels)."""
_STEPS = 48
"""Along a ray on its way out of the part."""
_CLEAR_MM = 1.0
"""A ray this far outside the silhouette is free; the chart's cells are 3 mm long."""


@dataclass(frozen=True)
class Outlook:
    """Of each cell of a :class:`Chart`, (S, N) for N cells around.

    Parameters
    ----------
    seen
        Whether camera and projector both reach it.
    tilt_deg
        Angle between its normal and the middle of the directions to camera and projector: where it is zero,
        the cell mirrors the projector into the camera.
    slope_deg
        Angle between its normal and the camera.
    shows
        (2, S, N) probability that a burr on metal that is measured there is called, less what no look finds:
        one along the generatrix, and one around the axis.
    faces
        (2, S, N) whether it faces a burr there that lies along the generatrix, or around the axis: sees both
        of its flanks (:func:`facing`).

    """

    seen: Bools
    tilt_deg: Floats
    slope_deg: Floats
    shows: Floats
    faces: Bools

    def __post_init__(self) -> None:
        freeze(self, seen=self.seen, tilt_deg=self.tilt_deg, slope_deg=self.slope_deg)
        freeze(self, shows=self.shows, faces=self.faces)


def outlook(
    chart: Chart,
    rig: Rig,
    T_camera_part: Floats,
    angles: Floats,
    *,
    lean_deg: float = 0.0,
) -> Outlook:
    """What a pose shows of the cells at ``angles`` (N,).

    Parameters
    ----------
    chart, rig, T_camera_part
        The part, the scanner, and the pose.
    angles
        Of cells around the axis, radians.
    lean_deg
        Of a flank: its normal is the surface's, leant over towards growing angles by so much.

    Notes
    -----
    O(S N steps). The part hides and shades itself by its silhouette: undercuts count as filled.

    """
    points, upright = chart.points_mm(angles), chart.normals(angles)
    around = np.stack([-np.sin(angles), np.cos(angles), np.zeros_like(angles)], axis=1)[None]
    lean = np.radians(lean_deg)
    normals = np.cos(lean) * upright + np.sin(lean) * around
    seen_by = placed(T_camera_part, points)
    eyes = rig.centres_mm(np.linalg.inv(T_camera_part))
    ways = [eye - points for eye in eyes]
    ways = [way / np.linalg.norm(way, axis=-1, keepdims=True) for way in ways]
    cosines = [(way * normals).sum(axis=-1) for way in ways]
    seen = np.minimum(*cosines) > np.cos(np.radians(STEEPEST_DEG))
    seen &= _inside(rig.camera.project(seen_by), rig.camera.shape)
    seen &= _inside(rig.correspond(seen_by), rig.projector.shape)
    for way in ways:
        seen[seen] = _free(chart, points[seen], way[seen])
    half = ways[0] + ways[1]
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    lines = np.broadcast_to(around, upright.shape), np.cross(upright, around)
    over, baseline = (ways[0] * upright).sum(axis=-1), eyes[1] - eyes[0]
    away = [(ways[0] * line).sum(axis=-1) for line in lines]
    around_mm, along_mm = (np.abs(line @ baseline) for line in lines)
    ways_to_lie = list(zip(away, (along_mm, around_mm), (around_mm, along_mm), strict=True))
    faces = [facing(over, *way) for way in ways_to_lie]
    shows = np.stack([_shown(over, *way) for way in ways_to_lie])
    tilt, slope = _degrees((half * normals).sum(axis=-1)), _degrees(cosines[0])
    return Outlook(seen, tilt, slope, shows, np.stack(faces))


def _shown(over: Floats, across: Floats, baseline_along: Floats, baseline_across: Floats) -> Floats:
    aside = aside_deg(over, across)
    lengthways, crossways = (np.interp(aside, ends, (1.0, 0.0)) for ends in _SHOWN_DEG)
    return np.where(baseline_along >= baseline_across, lengthways, crossways)


def aside_deg(over: Floats, across: Floats) -> Floats:
    """Angle between the surface's normal and the way to the camera, as it lies across a burr's line."""
    return np.asarray(np.degrees(np.arctan2(np.abs(across), over)))


def facing(over: Floats, across: Floats, baseline_along: Floats, baseline_across: Floats) -> Bools:
    """Whether a look sees both flanks of a burr, and neither by what it mirrors.

    Parameters
    ----------
    over, across
        The way to the camera along the surface's normal and across the burr's line.
    baseline_along, baseline_across
        From camera to projector, along the burr's line and across it: a flank mirrors the part inside the
        plane of the baseline and the ray, where nothing tells the mirrored light from its own.

    """
    return np.asarray(
        (aside_deg(over, across) <= ASIDE_DEG) & (np.abs(baseline_along) >= np.abs(baseline_across))
    )


def _inside(pixels: Floats, shape: tuple[int, int]) -> Bools:
    u, v = pixels[..., 0], pixels[..., 1]
    with np.errstate(invalid="ignore"):
        return np.asarray((u >= 0) & (v >= 0) & (u <= shape[1] - 1) & (v <= shape[0] - 1))


def _free(chart: Chart, points: Floats, ways: Floats) -> Bools:
    """(M,) whether rays from points (M, 3) leave the part."""
    reach = 2.0 * float(chart.silhouette[1].max()) + float(np.ptp(chart.silhouette[0]))
    # steps grow with the distance: what hides a point is mostly the next step of the wheel
    distance = reach * (np.arange(1, _STEPS + 1) / _STEPS) ** 2
    free = np.ones(len(points), np.bool_)
    for step in distance:
        at = points + step * ways
        limit = np.interp(at[:, 2], chart.silhouette[0], chart.silhouette[1], left=0.0, right=0.0)
        free &= np.hypot(at[:, 0], at[:, 1]) > limit - _CLEAR_MM
    return free


def _degrees(cosine: Floats) -> Floats:
    return np.asarray(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
