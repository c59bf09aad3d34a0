"""Where a burr that stands on an edge of the part is in one look: over the edge itself.

Its flanks lie on two faces, of which one is often out of sight, so neither depth nor light tells its middle
across. The faces do tell their edge: each is known by hundreds of points, burr or no burr, and the mill
belongs over the edge, flat on the face from which the burr stands up.
"""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.special import xlogy

from burrscan.arrays import Bools, Floats, Ints
from burrscan.burrs.edges import SHARP
from burrscan.burrs.pose import part_pose
from burrscan.cell.chart import beside
from burrscan.generatrix.polyline import polyline_of
from burrscan.inspection import Generatrix

_AROUND_MM = 6.0
"""Of the curve about the place expected in which faces are looked for, and so much more as it may be off."""
_STEP_MM = 0.1
"""Between places of the curve that are counted, so that long segments count as long."""
_ALIKE = np.cos(np.radians(10.0))
"""Normals within this are of one face."""
_APART_MM = 0.5
"""Off one another, along the normal, two places are of two faces: a step's two treads are no face."""
_SHORTEST_MM = 1.0
"""Of a face that is one."""
_MEETS_MM = 1.5
"""From where two faces would meet to the curve: a rounding of 3.6 mm is as far from its corner."""
_LINES = 3
"""Rounds in which what is rounded is left out of a face's line: a curve stands 0.07 mm over a sharp edge."""
_FLAT_MM = 0.02
"""What lies farther off a face's line than this, and than three times the median, is not of it."""
_UNKNOWN_MM = 0.015
"""Of an edge's place whatever its faces state: in the last looks at 12 rims the mill was off by 0.016 mm
(root mean square) from where the look had it."""
_HIGH = 0.4
"""Share of the burr's height from which a point stands out: a thin flake is measured at six tenths."""
_NEAR, _WIDEST_MM = 1.5, 2.0
"""Heights, and so much more, from the edge within which what stands out is the burr: its base may be that
wide."""
_FROM_EDGE_MM = 3.0
"""How far from an edge a call may lie that is of a burr on it: as far as the widest burrs reach."""
_LEAST = 12
"""Points that say from which face it stands up."""
_CLEAR, _LOWEST = 3.0, 0.1
"""Standard deviations of a point, and share of the burr's height, from which it stands out along an edge."""
_STANDS_OUT = 4.0
"""Standard deviations, by the likelihood ratio, between two shares of what stands out: some hundred stretches
are compared."""
_ALONG_MM = 0.25
"""Between stretches along the edge."""
_CLEARLY = 2.0
"""Standard deviations within which stretches are as good as the best."""


class Face(NamedTuple):
    """A straight face in the (z, r) plane: a place on it, its outward normal, how well it is known, mm."""

    at_mm: Floats
    normal: Floats
    sigma_mm: float


class Edge(NamedTuple):
    """Where two faces meet, (2,) mm (z, r), whether the part is rounded there or not."""

    at_mm: Floats
    faces: tuple[Face, Face]

    @property
    def sigma_mm(self) -> float:
        """Standard deviation of its place along a face."""
        return float(np.linalg.norm([self.faces[0].sigma_mm, self.faces[1].sigma_mm, _UNKNOWN_MM]))


def edge_near(generatrix: Generatrix, place_mm: Floats, *, within_mm: float) -> Edge | None:
    """The convex edge of a curve that is nearest to a place (z, r); None where there is none near.

    O(its length).
    """
    line = polyline_of(generatrix)
    at, segment = line.every(_STEP_MM)
    near = np.linalg.norm(at - place_mm, axis=1) <= _AROUND_MM + within_mm
    at, faces = at[near], _faces(at[near], line.normals[segment[near]], generatrix)
    edges = [
        Edge(_met(one, other), (one, other)) for one, other in combinations(faces, 2) if _convex(one, other)
    ]
    edges = [
        edge
        for edge in edges
        if np.linalg.norm(edge.at_mm - place_mm) <= within_mm
        and np.linalg.norm(edge.at_mm - at, axis=1).min() <= _MEETS_MM
    ]
    return min(edges, key=lambda edge: float(np.linalg.norm(edge.at_mm - place_mm)), default=None)


def _faces(at: Floats, normals: Floats, generatrix: Generatrix) -> list[Face]:
    """The straight faces among places of a curve (N, 2), the longest first."""
    level = (at * normals).sum(axis=1)
    alike = (normals @ normals.T > _ALIKE) & (np.abs(normals @ at.T - level[:, None]) < _APART_MM)
    left, faces = np.ones(len(at), np.bool_), []
    while left.any():
        own = left & alike[int(np.argmax(left * (alike & left).sum(axis=1)))]
        if np.count_nonzero(own) * _STEP_MM < _SHORTEST_MM:
            break
        left &= ~own
        faces.append(_straight(at[own], normals[own].mean(axis=0), generatrix))
    return faces


def _straight(at: Floats, normal: Floats, generatrix: Generatrix) -> Face:
    """The line through most of some places, whose mean normal is about right."""
    normal = normal / np.linalg.norm(normal)
    for _ in range(_LINES):
        above = at @ normal
        off = np.abs(above - np.median(above))
        on = off <= max(3.0 * float(np.median(off)), _FLAT_MM)
        slope, _ = np.polyfit(at[on] @ np.array([normal[1], -normal[0]]), above[on], 1)
        cosine, sine = 1.0 / np.hypot(1.0, slope), slope / np.hypot(1.0, slope)
        normal = np.array([cosine * normal[0] - sine * normal[1], sine * normal[0] + cosine * normal[1]])
        at = at[on]
    middle = at.mean(axis=0)
    nodes = np.stack([generatrix.z_mm, generatrix.r_mm], axis=1)
    on = (np.abs((nodes - middle) @ normal) < _FLAT_MM) & (
        np.linalg.norm(nodes - middle, axis=1) < _AROUND_MM
    )
    known = generatrix.sigma_mm[on]
    return Face(middle, normal, float(np.median(known)) if len(known) else _FLAT_MM)


def _met(one: Face, other: Face) -> Floats:
    """(2,) where the lines of two faces cross."""
    normals = np.stack([one.normal, other.normal])
    return np.asarray(np.linalg.solve(normals, [one.at_mm @ one.normal, other.at_mm @ other.normal]))


def _convex(one: Face, other: Face) -> bool:
    """Whether two faces meet in an edge of the part, not in a corner of it: each lies under the other."""
    turns = abs(float(one.normal @ other.normal)) < SHARP
    return turns and bool((other.at_mm - one.at_mm) @ one.normal < 0.0)


def standing(
    edge: Edge,
    T_part_burr: Floats,
    points_mm: Floats,
    deviation_mm: Floats,
    *,
    high_mm: float,
    half_mm: float,
) -> Face | None:
    """The face of an edge from which a burr stands up; None where too little of it was measured. O(points).

    Parameters
    ----------
    edge
        That it stands on.
    T_part_burr
        (4, 4) about where it is.
    points_mm, deviation_mm
        (N, 3) in the part frame, and (N,) by how much each stands out of the curve.
    high_mm, half_mm
        The burr's height, and half of its length.

    """
    around, away, near = _beside_edge(edge, T_part_burr, points_mm, high_mm)
    out = near & (deviation_mm > _HIGH * high_mm) & (np.abs(around) < half_mm)
    if np.count_nonzero(out) < _LEAST:
        return None
    way = np.median(away[out], axis=0)
    return max(edge.faces, key=lambda one: float(one.normal @ way))


def on_its_edge(
    generatrix: Generatrix,
    T_part_burr: Floats,
    points_mm: Floats,
    deviation_mm: Floats,
    *,
    high_mm: float,
    half_mm: float,
) -> Floats:
    """(4, 4) the pose of a burr that goes around the axis, put on its edge; as it is where there is none.

    Parameters as of :func:`standing`, but for the ``generatrix`` that has the edge.
    """
    place = np.array([T_part_burr[2, 3], np.hypot(*T_part_burr[:2, 3])])
    edge = edge_near(generatrix, place, within_mm=_FROM_EDGE_MM)
    if edge is None:
        return T_part_burr
    face = standing(edge, T_part_burr, points_mm, deviation_mm, high_mm=high_mm, half_mm=half_mm)
    return T_part_burr if face is None else pose_over(edge, face, T_part_burr)


def pose_over(edge: Edge, face: Face, T_part_burr: Floats, *, along_mm: float = 0.0) -> Floats:
    """(4, 4) the pose on an edge: z the normal of a face of it, x around the axis in the burr's own sense.

    ``along_mm`` is the way from the burr's place along x.
    """
    x, y = T_part_burr[:2, 3]
    sense = float(np.sign(T_part_burr[:3, 0] @ [-y, x, 0.0])) or 1.0
    angle = float(np.arctan2(y, x)) + sense * along_mm / float(edge.at_mm[1])
    return part_pose(edge.at_mm, face.normal, angle, np.array([sense, 0.0]))


def along_edge(
    edge: Edge,
    T_part_burr: Floats,
    points_mm: Floats,
    deviation_mm: Floats,
    sigma_mm: Floats,
    *,
    high_mm: float,
    half_mm: float,
    gate_mm: float,
) -> float | None:
    """How far along an edge, mm, a burr is from where it is expected; None where nothing stands out there.

    In a stretch of its length more stands out than on the rest of the same edge, where curve and roundings
    err alike: two shares against one (the ratio of their likelihoods; Wilks 1938). From above little of a
    thin burr is measured, some points in a hundred, so of the stretches that are about as likely the one
    nearest to the place expected is taken. O(points × places tried).

    Parameters
    ----------
    edge, T_part_burr, points_mm, deviation_mm, high_mm, half_mm
        As of :func:`standing`.
    sigma_mm
        (N,) standard deviations of the points.
    gate_mm
        How far it may be.

    """
    around, _, near = _beside_edge(edge, T_part_burr, points_mm, high_mm)
    out = deviation_mm[near] > np.maximum(_CLEAR * sigma_mm[near], _LOWEST * high_mm)
    around = around[near]
    steps = np.arange(-gate_mm, gate_mm + 0.5 * _ALONG_MM, _ALONG_MM)
    inside = np.abs(around - steps[:, None]) < half_mm
    count, hits = inside.sum(axis=1), (inside & out).sum(axis=1)
    rest, more = len(out) - count, out.sum() - hits
    gain = 2.0 * (_told(hits, count) + _told(more, rest) - _told(out.sum(), np.array(len(out))))
    gain = np.where(hits * rest > more * count, gain, 0.0)
    if not gain.max() > _STANDS_OUT**2:
        return None
    return float(min(steps[gain >= gain.max() - _CLEARLY**2], key=abs))


def _told(hits: Ints, count: Ints) -> Floats:
    """Logarithm of the likelihood of so many of so many, at the share that they are."""
    share = hits / np.maximum(count, 1)
    return np.asarray(xlogy(hits, share) + xlogy(count - hits, 1.0 - share))


def _beside_edge(
    edge: Edge, T_part_burr: Floats, points_mm: Floats, high_mm: float
) -> tuple[Floats, Floats, Bools]:
    """(N,) how far points are along the burr, (N, 2) off the edge, and which are near enough to be of it."""
    away = np.stack([points_mm[:, 2], np.hypot(points_mm[:, 0], points_mm[:, 1])], axis=1) - edge.at_mm
    near = np.linalg.norm(away, axis=1) < _NEAR * high_mm + _WIDEST_MM
    return beside(T_part_burr, points_mm)[:, 0], away, near
