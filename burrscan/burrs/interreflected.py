"""Light that came by way of another part of the wheel, and passes for a burr.

In an inner corner, in a bore, between a hub and its flange metal mirrors itself. Where what is mirrored
outshines what the projector sends there directly, a pixel reads the column of the place that it sees in the
mirror, and its depth is that of a virtual surface. The fitted wheel tells both columns: that of the place
that the camera's ray meets, and that of the place that the mirrored ray meets next. What was read lies
between the two, the nearer to the second the more of the light came that way. A burr stands on the wheel
instead: what it reads is off by its height, and the mirrored column by twice the distance to the corner.
"""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats
from burrscan.axis.basis import T_part_mesh
from burrscan.generatrix.polyline import Polyline, turned
from burrscan.generatrix.ray import first_met
from burrscan.inspection import Axis
from burrscan.pose import placed
from burrscan.rig import Rig

_MIRRORED, _BEYOND = 0.25, 1.5
"""Shares of the way to the mirrored column from which what was read is mirrored light, and up to which: rough
metal mirrors a lobe, not a ray. Of three calls in corners of turned and oxidised wheels the vertices had 0.35
to 0.87, of burrs beside flanges and in grooves -0.14 to 0.14."""
_MOST = 0.5
"""Share of an anomaly's points that are mirrored: most of them."""
_LEAVES = 1e-6
"""Share of the distance to the camera that a ray must go to meet anything: arithmetic puts where it starts
beside the surface."""


def is_interreflected(points_mm: Floats, axis: Axis, line: Polyline, rig: Rig) -> bool:
    """Whether most of an anomaly's points, (N, 3) in the camera frame, are what the wheel mirrors of itself.

    As :func:`share_mirrored`, which see. O(N · segments of the line).
    """
    share = share_mirrored(points_mm, axis, line, rig)
    mirrored = (share > _MIRRORED) & (share < _BEYOND)
    return bool(np.count_nonzero(mirrored) > _MOST * len(share))


def share_mirrored(points_mm: Floats, axis: Axis, line: Polyline, rig: Rig) -> Floats:
    """How much of the way from a place's own column to the mirrored one what was read lies.

    Parameters
    ----------
    points_mm
        (N, 3) measured points, camera frame.
    axis, line
        The fitted wheel.
    rig
        The calibration that the points rest on.

    Returns
    -------
    ndarray
        (N,) 0 for a point on the surface, 1 for one that is all mirrored; NaN where the mirrored ray meets
        nothing of the wheel, or nothing that faces the projector.

    Notes
    -----
    O(N · segments of the line).

    """
    T_part_camera = T_part_mesh(axis.point_mm, axis.direction)
    T_camera_part = np.linalg.inv(T_part_camera)
    camera, projector = rig.centres_mm(T_part_camera)
    ray = placed(T_part_camera, points_mm) - camera
    ray /= np.linalg.norm(ray, axis=1, keepdims=True)
    own, normal = _met(line, np.broadcast_to(camera, ray.shape), ray)
    mirrored = ray - 2.0 * (ray * normal).sum(axis=1, keepdims=True) * normal
    other, facing = _met(line, own, mirrored)
    lit = ((projector - other) * facing).sum(axis=1) > 0.0
    seen = (points_mm, *(placed(T_camera_part, place) for place in (own, other)))
    read, here, there = (rig.correspond(place)[:, 0] for place in seen)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(lit, (read - here) / (there - here), np.nan)


def _met(line: Polyline, origin_mm: Floats, direction: Floats) -> tuple[Floats, Floats]:
    """(N, 3) places where rays first meet the wheel, and the outward normals there; NaN where none is met."""
    leaves = _LEAVES * float(np.nanmax(np.linalg.norm(origin_mm, axis=1), initial=0.0))
    far, segment = first_met(line, origin_mm, direction, beyond_mm=leaves)
    place = origin_mm + np.where(segment < 0, np.nan, far)[:, None] * direction
    return place, turned(line.normals[segment], np.arctan2(place[:, 1], place[:, 0]))
