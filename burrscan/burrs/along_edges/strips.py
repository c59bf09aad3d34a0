"""The pixels along an edge of the part: how far along it each lies, and how far beside it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from burrscan.arrays import Bools, Floats, Ints
from burrscan.axis.basis import T_part_mesh
from burrscan.burrs.pixel import pixel_mm
from burrscan.generatrix.polyline import Polyline, is_closed, revolved
from burrscan.inspection import Axis
from burrscan.pose import placed
from burrscan.sight import Sight
from burrscan.turns import turn_rad

REACH = 8
"""Pixels to either side of an edge: three for a burr, as many for what is beside it, and two between."""
_TURNS = np.radians(30.0)
"""By so much at least the curve turns at an edge, from one of the chords below to the next."""
_CHORD = (0.75, 3.0)
"""Where the chords before and after an edge begin and end, in pixels from it."""
_SHARPEST = 0.98
"""Of the largest turn: about a sharp corner all places within half a chord's gap turn as much."""
_STEP = 0.25
"""Of the curve and of an edge, in pixels."""
_FACED = 0.3
"""Cosine, 73 degrees, at which camera and projector meet a face at least: else its pixels see too much."""
_SEEN = (3, 5.0)
"""An edge is seen where within so many pixels of the picture a point was measured that is within so many
pixels' size of it."""
_FEWEST = 200
"""Pixels along an edge: fewer tell nothing about what its light is like."""


class Strip(NamedTuple):
    """Pixels (P,) along a convex edge, or along an open end of the curve.

    Parameters
    ----------
    place
        (2,) of the edge (z, r), part frame.
    normal
        (2,) outward normal (z, r) of the faces that meet there, their mean.
    row, column
        (P,) pixels.
    arc_px, off_px
        (P,) how far along the edge's image, from its first pixel, and how far beside it.
    angle
        (P,) around the axis, radians, part frame.
    from_mirror
        (P,) radians by which a rounding's normals miss the one that mirrors the projector into the camera,
        negative on one side of where they miss it by least.
    pixel_mm
        A pixel's size on the part.

    """

    place: Floats
    normal: Floats
    row: Ints
    column: Ints
    arc_px: Floats
    off_px: Floats
    angle: Floats
    from_mirror: Floats
    pixel_mm: float


class _Edge(NamedTuple):
    """Place (z, r), and the directions in which its faces lie: before it and after it, None for no face.

    And how far the curve goes there, mm.
    """

    place: Floats
    before: Floats | None
    after: Floats | None
    length_mm: tuple[float, float]


class _Scene(NamedTuple):
    """What was seen, and camera and projector, part frame, with a pixel's size on the part."""

    sight: Sight
    T_camera_part: Floats
    eye: Floats
    lamp: Floats
    pixel_mm: float

    def in_picture(self, part_mm: Floats) -> Floats:
        """(N, 2) pixels (x, y) of points (N, 3) of the part frame."""
        return self.sight.rig.camera.project(placed(self.T_camera_part, part_mm))

    def projected_on(self, part_mm: Floats) -> Bools:
        """(N,) which points (N, 3) of the part frame the projector lights, a strip off its border."""
        rig = self.sight.rig
        off = REACH * self.pixel_mm * rig.projector.fx / np.linalg.norm(part_mm - self.lamp, axis=1)
        inside: Bools = rig.within_light_px(placed(self.T_camera_part, part_mm)) > off
        return inside


class _Circle(NamedTuple):
    """Half of an edge, which the camera may see: angles (N,), points in the part frame, pixels (x, y)."""

    angle: Floats
    part: Floats
    xy: Floats


def strips(sight: Sight, axis: Axis, line: Polyline) -> list[Strip]:
    """One for each edge of the ideal surface that the scan shows. O(pixels near edges × log).

    ``line`` is the ideal curve, and all is as the scan was calibrated: where no burr is, the edge is there.
    """
    T_part_camera = T_part_mesh(axis.point_mm, axis.direction)
    eye, lamp = sight.rig.centres_mm(T_part_camera)
    T_camera_part = np.asarray(np.linalg.inv(T_part_camera), np.float64)
    size_mm = pixel_mm(sight.rig, eye, line)
    scene = _Scene(sight, T_camera_part, eye, lamp, size_mm)
    edges = (edge for edge in _edges(line, size_mm) if edge.place[1] > REACH * size_mm)
    found = (_strip(edge, _circle(edge, scene), scene) for edge in edges)
    return [strip for strip in found if strip is not None]


def _edges(line: Polyline, pixel_mm: float) -> list[_Edge]:
    """Convex corners, where the curve turns within a few pixels, and the open ends. O(length in pixels)."""
    found = []
    for first, last in line.pieces:
        nodes = line.nodes_mm[first : last + 1]
        along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(nodes, axis=0).T))])
        if along[-1] < 4.0 * pixel_mm:
            continue

        def on(at: Floats, nodes: Floats = nodes, along: Floats = along) -> Floats:
            return np.stack([np.interp(at, along, nodes[:, 0]), np.interp(at, along, nodes[:, 1])], axis=1)

        near, far = (reach * pixel_mm for reach in _CHORD)
        at = np.arange(2.0 * near, along[-1] - 2.0 * near, _STEP * pixel_mm)
        before, after = (_unit(on(at + sign * far) - on(at + sign * near)) for sign in (-1.0, 1.0))
        turn = np.arctan2(
            before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0], -(before * after).sum(axis=1)
        )
        while len(turn) and turn.max() > _TURNS:
            beside = np.abs(at - at[int(turn.argmax())]) < 0.5 * far
            corner = int(np.median(np.flatnonzero(beside & (turn > _SHARPEST * turn.max()))))
            length = float(at[corner]), float(along[-1] - at[corner])
            found.append(_Edge(on(at[[corner]])[0], before[corner], after[corner], length))
            turn[np.abs(at - at[corner]) < 1.5 * far] = 0.0
        if not is_closed(nodes):
            ends = on(np.array([0.0, far, along[-1] - far, along[-1]]))
            found.append(_Edge(ends[0], None, _unit(ends[[1]] - ends[[0]])[0], (0.0, float(along[-1]))))
            found.append(_Edge(ends[3], _unit(ends[[2]] - ends[[3]])[0], None, (float(along[-1]), 0.0)))
    return found


def _unit(vectors: Floats) -> Floats:
    unit: Floats = vectors / np.maximum(np.linalg.norm(vectors, axis=1), 1e-12)[:, None]
    return unit


def _circle(edge: _Edge, scene: _Scene) -> _Circle:
    half = np.arange(0.0, 0.5 * np.pi, _STEP * scene.pixel_mm / edge.place[1])
    angle = np.arctan2(scene.eye[1], scene.eye[0]) + np.concatenate([-half[:0:-1], half])
    part = revolved(edge.place[None], angle)[0]
    return _Circle(angle, part, scene.in_picture(part))


def _strip(edge: _Edge, circle: _Circle, scene: _Scene) -> Strip | None:
    """The pixels beside a visible edge that see one of its faces; None for too few."""
    seen = np.flatnonzero(_seen(circle, scene))
    if len(seen) < _FEWEST:
        return None
    radiance = scene.sight.radiance
    tangent = _unit(np.gradient(circle.xy, axis=0))
    beside = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
    x, y, nearest = _pixels_near(circle.xy[seen], radiance.shape)
    nearest = seen[nearest]
    away = np.stack([x, y], axis=1) - circle.xy[nearest]
    off = (away * beside[nearest]).sum(axis=1)
    known = (np.abs((away * tangent[nearest]).sum(axis=1)) < 1.0) & np.isfinite(radiance[y, x])
    known &= _on_a_face(edge, circle, beside, off, nearest, scene)
    if np.count_nonzero(known) < _FEWEST:
        return None
    x, y, off, nearest = x[known], y[known], off[known], nearest[known]
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(circle.xy, axis=0), axis=1))])[nearest]
    half_way = _unit(_unit(scene.eye - circle.part) + _unit(scene.lamp - circle.part))
    return Strip(
        edge.place,
        _unit(np.sum([normal for _, normal, _ in _faces(edge)], axis=0)[None])[0],
        y,
        x,
        arc - arc.min(),
        off,
        circle.angle[nearest],
        _from_mirror(edge, circle, half_way)[nearest],
        scene.pixel_mm,
    )


def _from_mirror(edge: _Edge, circle: _Circle, half_way: Floats) -> Floats:
    """(N,) radians between half-way vectors (N, 3) and the nearest of the rounding's normals, with a sign.

    Those lie in the plane through the axis, between the normals of the faces. Seen from the part's end a
    glint reaches far around the axis, for there the half-way vector turns little out of that plane.
    """
    cos, sin = np.cos(circle.angle), np.sin(circle.angle)
    out = half_way[:, 0] * cos + half_way[:, 1] * sin
    aside = half_way[:, 1] * cos - half_way[:, 0] * sin
    normals = np.array([normal for _, normal, _ in _faces(edge)])
    (z, r) = normals.mean(axis=0)
    # of an open end nobody knows how far its rounding turns
    half = 0.5 * np.arccos(np.clip(normals[0] @ normals[1], -1.0, 1.0)) if len(normals) > 1 else np.pi
    turn = np.abs(turn_rad(np.arctan2(out, half_way[:, 2]) - np.arctan2(r, z)))
    beyond = np.maximum(turn - half, 0.0)
    missed: Floats = np.arccos(np.clip(np.hypot(out, half_way[:, 2]) * np.cos(beyond), -1.0, 1.0))
    return np.copysign(missed, aside)


def _faces(edge: _Edge) -> list[tuple[Floats, Floats, float]]:
    """Where the faces of an edge lie, (z, r), their outward normals, and how far they go, mm.

    Material is right of the curve.
    """
    faces = ((edge.before, -1.0, edge.length_mm[0]), (edge.after, 1.0, edge.length_mm[1]))
    return [(face, way * np.array([-face[1], face[0]]), far) for face, way, far in faces if face is not None]


def _seen(circle: _Circle, scene: _Scene) -> Bools:
    """(N,) where the edge lies in both pictures and something was measured beside it: nothing hides it."""
    height, width = scene.sight.radiance.shape
    reach, near = _SEEN
    x, y = np.rint(circle.xy).astype(np.int64).T
    inside = (x > REACH) & (x < width - REACH - 1) & (y > REACH) & (y < height - REACH - 1)
    inside &= scene.projected_on(circle.part)
    seen = np.zeros(len(inside), np.bool_)
    at = np.flatnonzero(inside)
    points_mm, edge_mm = scene.sight.points_mm, placed(scene.T_camera_part, circle.part[at])
    for right in range(-reach, reach + 1):
        for down in range(-reach, reach + 1):
            gap = np.linalg.norm(points_mm[y[at] + down, x[at] + right] - edge_mm, axis=1)
            seen[at] |= gap < near * scene.pixel_mm  # NaN is not near
    return seen


def _pixels_near(xy: Floats, shape: tuple[int, int]) -> tuple[Ints, Ints, Ints]:
    """Pixels (x, y) within reach of some places in the picture, and the nearest place of each."""
    low = np.maximum(np.floor(xy.min(axis=0)).astype(int) - REACH, 0)
    high = np.minimum(np.ceil(xy.max(axis=0)).astype(int) + REACH + 1, [shape[1], shape[0]])
    y, x = (grid.ravel() for grid in np.mgrid[low[1] : high[1], low[0] : high[0]])
    distance, nearest = cKDTree(xy).query(np.stack([x, y], axis=1), distance_upper_bound=REACH + 1.0)
    near = np.isfinite(distance)
    return x[near], y[near], np.asarray(nearest, np.int64)[near]


def _on_a_face(
    edge: _Edge, circle: _Circle, beside: Floats, off: Floats, nearest: Ints, scene: _Scene
) -> Bools:
    """(P,) which pixels lie on a face that camera and projector both meet, or on the edge.

    Beyond where the curve ends nobody knows what they see.
    """
    on = np.zeros(len(off), np.bool_)
    for face, outward, length_mm in _faces(edge):
        normal, inwards = revolved(np.stack([outward, face]), circle.angle)
        cosines = [(normal * _unit(each - circle.part)).sum(axis=1) for each in (scene.eye, scene.lamp)]
        inner = circle.part + _CHORD[1] * scene.pixel_mm * inwards
        towards = ((scene.in_picture(inner) - circle.xy) * beside).sum(axis=1)[nearest]
        faced = (np.minimum(*cosines) > _FACED)[nearest]
        ends = np.abs(towards) * length_mm / (_CHORD[1] * scene.pixel_mm)
        on |= faced & ((np.sign(off) == np.sign(towards)) & (np.abs(off) < ends) | (np.abs(off) < 0.5))
    return on
