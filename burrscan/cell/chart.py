"""The part as a map: its surface of revolution divided along the generatrix and around the axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from burrscan.arrays import Bools, Floats, Ints, freeze
from burrscan.generatrix.polyline import Polyline, join, revolved
from burrscan.generatrix.ray import first_met
from burrscan.inspection import Generatrix
from burrscan.turns import turn_rad

AROUND = 120
"""Cells around the axis: 3 degrees each, so that candidates 3 or more degrees apart are shifts of the map."""
_ALONG_MM = 3.0
"""Length of a cell along the generatrix: a burr's, not a pixel's."""
_LEAVES_MM = 1e-3
"""A ray meets nothing so near to where it starts: arithmetic puts the start above or below its cell."""


@dataclass(frozen=True)
class Chart:
    """S cells along the generatrix, each all around the axis, in the part frame.

    Parameters
    ----------
    zr_mm
        (S, 2) their middles.
    normals_zr
        (S, 2) outward unit normals.
    area_mm2
        (S,) of one of the :data:`AROUND` cells.
    outline
        The cells' chords, one segment each: by them the part hides and shades itself. What is not known of
        the generatrix hides nothing.

    """

    zr_mm: Floats
    normals_zr: Floats
    area_mm2: Floats
    outline: Polyline

    def __post_init__(self) -> None:
        freeze(self, zr_mm=self.zr_mm, normals_zr=self.normals_zr, area_mm2=self.area_mm2)

    @property
    def shape(self) -> tuple[int, int]:
        """Cells along and around."""
        return len(self.zr_mm), AROUND

    @property
    def angles(self) -> Floats:
        """(AROUND,) middles of the cells, radians from 0."""
        return np.asarray((np.arange(AROUND) + 0.5) * (2.0 * np.pi / AROUND), float)

    def points_mm(self, cells: Floats) -> Floats:
        """(S, N, 3) middles of the cells at the angles ``cells`` (N,)."""
        return revolved(self.zr_mm, cells)

    def normals(self, cells: Floats) -> Floats:
        """(S, N, 3) their outward normals."""
        return revolved(self.normals_zr, cells)

    def cells_of(self, points_mm: Floats, *, within_mm: float = 2.0 * _ALONG_MM) -> tuple[Ints, Ints]:
        """(N,) cell along, -1 for points that are farther than ``within_mm`` from each, and (N,) around."""
        zr = np.stack([points_mm[:, 2], np.hypot(points_mm[:, 0], points_mm[:, 1])], axis=1)
        distance_mm, nearest = cKDTree(self.zr_mm).query(zr)
        along = np.where(distance_mm > within_mm, -1, nearest)
        return along, angle_cells(points_mm)

    def between(self, which: Bools, angles: Floats, eye_mm: Floats) -> Ints:
        """(M,) the first cell on the straight way to a point (3,) from each of some cells, -1 where none is.

        ``which`` (S, N) of those at ``angles`` (N,) are asked for, each from its chord's middle. O(M S).
        """
        middle = np.arange(len(self.zr_mm)), np.full(len(self.zr_mm), 0.5)
        starts = revolved(self.outline.places_mm(*middle), angles)[which]
        ways = eye_mm - starts
        ways /= np.linalg.norm(ways, axis=1, keepdims=True)
        return first_met(self.outline, starts, ways, beyond_mm=_LEAVES_MM)[1]


def line_of(T_part_burr: Floats) -> int:
    """0 for a burr that lies along the generatrix, 1 for one that goes around the axis."""
    x, y = T_part_burr[:2, 3] / max(float(np.hypot(*T_part_burr[:2, 3])), 1e-9)
    return int(abs(T_part_burr[:3, 0] @ [-y, x, 0.0]) > np.sqrt(0.5))


def walked(T_part_burr: Floats, along_mm: Floats, across_mm: Floats | float = 0.0) -> Floats:
    """(N, 3) places on a burr's line: what of it goes around the axis goes around at its radius."""
    x, y, z = T_part_burr[:3, 3]
    r, angle = float(np.hypot(x, y)), float(np.arctan2(y, x))
    radial = np.array([np.cos(angle), np.sin(angle), 0.0])
    around = np.array([-np.sin(angle), np.cos(angle), 0.0])
    across = np.broadcast_to(across_mm, along_mm.shape)
    step = along_mm[:, None] * T_part_burr[:3, 0] + across[:, None] * T_part_burr[:3, 1]
    angles, radii = angle + step @ around / max(r, 1e-6), r + step @ radial
    return np.stack([radii * np.cos(angles), radii * np.sin(angles), z + step[:, 2]], axis=1)


def beside(T_part_burr: Floats, points_mm: Floats) -> Floats:
    """(N, 3) points of the part frame along a burr, across it and above its middle; the way round is arc.

    The inverse of :func:`walked`, for a burr that lies along the generatrix or around the axis. O(N).
    """
    x, y, z = T_part_burr[:3, 3]
    r, angle = float(np.hypot(x, y)), float(np.arctan2(y, x))
    axes = np.stack(
        [[-np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0], [np.cos(angle), np.sin(angle), 0.0]]
    )
    around = r * turn_rad(np.arctan2(points_mm[:, 1], points_mm[:, 0]) - angle)
    away = [around, points_mm[:, 2] - z, np.hypot(points_mm[:, 0], points_mm[:, 1]) - r]
    return np.asarray(np.stack(away, axis=1) @ (axes @ T_part_burr[:3, :3]))


def angle_cells(points_mm: Floats) -> Ints:
    """(N,) the cells around the axis in which points (N, 3) lie."""
    angle = np.arctan2(points_mm[:, 1], points_mm[:, 0])
    return np.asarray(np.floor(angle * (AROUND / (2.0 * np.pi))), np.int64) % AROUND


def chart_of(generatrix: Generatrix) -> Chart:
    """The map of a part from its generatrix in the part frame, its material to the right. O(its length)."""
    middles, tangents, lengths, chords = [], [], [], []
    for z, r in _pieces(generatrix):
        walked = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(z), np.diff(r)))])
        count = max(1, round(walked[-1] / _ALONG_MM))
        ends = np.linspace(0.0, walked[-1], count + 1)
        corners = np.stack([np.interp(ends, walked, z), np.interp(ends, walked, r)], axis=1)
        middle = 0.5 * (ends[1:] + ends[:-1])
        middles.append(np.stack([np.interp(middle, walked, z), np.interp(middle, walked, r)], axis=1))
        step = np.diff(corners, axis=0)
        tangents.append(step / np.maximum(np.linalg.norm(step, axis=1, keepdims=True), 1e-12))
        lengths.append(np.full(count, walked[-1] / count))
        chords.append(corners)
    zr, tangent = np.concatenate(middles), np.concatenate(tangents)
    area = np.concatenate(lengths) * zr[:, 1] * (2.0 * np.pi / AROUND)
    return Chart(zr, np.stack([-tangent[:, 1], tangent[:, 0]], axis=1), area, join(chords))


def _pieces(generatrix: Generatrix) -> list[tuple[Floats, Floats]]:
    """Connected stretches of two points or more."""
    known: Bools = np.isfinite(generatrix.z_mm) & np.isfinite(generatrix.r_mm)
    ends = np.flatnonzero(np.diff(np.concatenate([[0], known.astype(np.int8), [0]])))
    pieces = zip(ends[::2], ends[1::2], strict=True)
    return [(generatrix.z_mm[a:b], generatrix.r_mm[a:b]) for a, b in pieces if b - a > 1]
