"""What is known exactly of a wheel: its burrs, and how far any point is from its ideal outline."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numba import njit
from scipy.spatial import cKDTree

from burrscan.arrays import Bools, Floats, Ints, Ints32, freeze
from burrscan.turns import turn_deg

_CELLS = 96
"""Along each side of the grid of candidate segments: a cell then holds a few; more cost more to fill."""
_COARSE = 12
"""The same of the first, coarse grid; divides the fine one."""
_MARGIN_MM = 4.0
"""Of the grid beyond the outline: burrs reach so far; farther points are found without it."""
_ON_BODY_MM = 5e-3
"""Distance from the ideal surface up to which a point is the wheel's: facets err by as much."""
_BESIDE_MM = 0.5
"""Margin of a burr's extent in angle and z: a camera pixel's ray meets the flank beside it."""
_NO_GRID = (np.zeros(1, np.int64), np.zeros(0, np.int64))
"""Of no candidates: every segment is tried."""


@dataclass(frozen=True)
class TrueBurr:
    """A burr as it is.

    Parameters
    ----------
    kind
        ``axial_ridge``, ``rim`` or ``nick``.
    side
        ``protrusion`` or ``nick``.
    angle_deg
        atan2 angle of its middle in the part frame.
    z_start_mm, z_end_mm
        Extent along the axis.
    height_mm
        Largest distance from the ideal outline along its normal; positive for nicks too.
    width_mm
        Width of the base.
    length_mm
        Along the burr: along the axis for ridges and nicks, along the arc for rim burrs.
    area_mm2
        Mean cross-section: volume over length.
    volume_mm3
        Material too much or missing against the wheel without burrs, from the boolean.
    ridge_mm
        (N, 3) points along its crest (a nick's bottom), part frame; a nick's only where it is in the wheel.
    deviation_mm
        (N,) signed distance of those points from the ideal outline.
    arc_deg
        Angular extent.
    section
        Shape of its cross-section, as in :class:`scenes.wheel.spec.Shape`.
    position_mm
        (N,) where along the burr, from its start, the points of ``ridge_mm`` are.
    thickness_mm
        (N,) mean thickness there: the section's area over its height.
    pieces_mm
        (P, 2) start and end along the burr of each piece; between pieces it is torn off.

    """

    kind: str
    side: Literal["protrusion", "nick"]
    angle_deg: float
    z_start_mm: float
    z_end_mm: float
    height_mm: float
    width_mm: float
    length_mm: float
    area_mm2: float
    volume_mm3: float
    ridge_mm: Floats
    deviation_mm: Floats
    arc_deg: float
    section: str = "triangle"
    position_mm: Floats = field(default_factory=lambda: np.zeros(0))
    thickness_mm: Floats = field(default_factory=lambda: np.zeros(0))
    pieces_mm: Floats = field(default_factory=lambda: np.zeros((0, 2)))

    def __post_init__(self) -> None:
        freeze(self, ridge_mm=self.ridge_mm, deviation_mm=self.deviation_mm)
        freeze(self, position_mm=self.position_mm, thickness_mm=self.thickness_mm, pieces_mm=self.pieces_mm)

    @property
    def torn_share(self) -> float:
        """Share of the length that is torn off."""
        return (
            1.0 - float(np.ptp(self.pieces_mm, axis=1).sum()) / self.length_mm if len(self.pieces_mm) else 0.0
        )

    def height_at(self, position_mm: Floats) -> Floats:
        """(M,) height or depth at positions along the burr, mm; 0 where it is torn off or ended. O(M P)."""
        position = np.asarray(position_mm, float)
        heights = np.interp(position, self.position_mm, np.abs(self.deviation_mm))
        there = [(position >= start) & (position <= end) for start, end in self.pieces_mm]
        return np.where(np.any(there, axis=0), heights, 0.0)


def deviation_mm(points_mm: Floats, generatrix_zr_mm: Floats) -> Floats:
    """Signed distance of points from the ideal surface, outwards positive.

    The distance to the nearest point of the outline, which is the distance along the normal; its sign is by
    the normal there, at a vertex by the mean of its two normals (Bærentzen & Aanæs 2005). Exact for the given
    outline: a grid over the (z, r) plane lists in each cell the segments that can be nearest.

    Parameters
    ----------
    points_mm
        (N, 3) in the part frame.
    generatrix_zr_mm
        (K, 2) the outline, with the outside to the left (:attr:`scenes.wheel.Wheel.generatrix_zr_mm`).

    Returns
    -------
    (N,) mm.

    Notes
    -----
    O(cells · K) once per call, then O(1) per point near the outline and O(K) per point more than 4 mm outside
    its bounding box.

    """
    points = np.asarray(points_mm, float)
    zr = np.stack([points[:, 2], np.hypot(points[:, 0], points[:, 1])], axis=1)
    curve = np.ascontiguousarray(generatrix_zr_mm, float)
    low = curve.min(axis=0) - _MARGIN_MM
    size = (curve.max(axis=0) + _MARGIN_MM - low) / _CELLS
    # for few points the grid costs more than it saves: every segment is tried
    first, listed = _candidates(curve, low, size) if len(zr) > _CELLS**2 else _NO_GRID
    return np.asarray(_signed_distances(zr, curve, _vertex_normals(curve), low, size, first, listed))


def burr_at(points_mm: Floats, *, burrs: tuple[TrueBurr, ...], generatrix_zr_mm: Floats) -> Ints32:
    """(N,) index of the burr that each surface point lies on, -1 for none.

    A point off the ideal outline by more than 5 µm, on the burr's side and within half a millimetre of its
    extent, lies on it; of several burrs, on the one whose crest is nearest.

    Parameters
    ----------
    points_mm
        (N, 3) surface points in the part frame.
    burrs, generatrix_zr_mm
        Of the wheel.

    """
    points = np.asarray(points_mm, float)
    deviation = deviation_mm(points, generatrix_zr_mm)
    owner = np.full(len(points), -1, np.int32)
    nearest = np.full(len(points), np.inf)
    for index, burr in enumerate(burrs):
        signed = deviation if burr.side == "protrusion" else -deviation
        near = np.flatnonzero((signed > _ON_BODY_MM) & _within(points, burr))
        distance = np.asarray(cKDTree(burr.ridge_mm).query(points[near])[0])
        closer = distance < nearest[near]
        owner[near[closer]] = index
        nearest[near[closer]] = distance[closer]
    return owner


def _within(points: Floats, burr: TrueBurr) -> Bools:
    """Whether points lie in the burr's extent in angle and z, with a margin and its lean."""
    radius = np.hypot(points[:, 0], points[:, 1])
    angle = np.degrees(np.arctan2(points[:, 1], points[:, 0])) - burr.angle_deg
    off_mm = np.abs(np.radians(turn_deg(angle))) * radius
    half_mm = np.radians(burr.arc_deg) / 2.0 * radius + _BESIDE_MM
    if burr.kind != "rim":
        crest = np.degrees(np.arctan2(burr.ridge_mm[:, 1], burr.ridge_mm[:, 0])) - burr.angle_deg
        half_mm = half_mm + np.radians(np.abs(turn_deg(crest)).max()) * radius
    along = (points[:, 2] > burr.z_start_mm - _BESIDE_MM) & (points[:, 2] < burr.z_end_mm + _BESIDE_MM)
    return np.asarray(along & (off_mm < half_mm))


def _vertex_normals(curve: Floats) -> Floats:
    """(K, 2) sums of the unit normals of the segments at each vertex; only their direction counts."""
    along = np.diff(curve, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    normals = np.stack([-along[:, 1], along[:, 0]], axis=1)
    before = np.concatenate([normals[:1], normals])
    after = np.concatenate([normals, normals[-1:]])
    if np.array_equal(curve[0], curve[-1]):
        before[0], after[-1] = normals[-1], normals[0]
    return np.asarray(before + after)


def _candidates(curve: Floats, low: Floats, size: Floats) -> tuple[Ints, Ints]:
    """Per grid cell the segments that may be nearest to a point of it, as a compressed list.

    Coarse cells choose among all segments, the cells inside each among its choice.
    """
    everything = np.arange(len(curve) - 1)
    first, listed = np.array([0, len(everything)]), everything
    parent = np.zeros(_COARSE**2, np.int64)
    for cells in (_COARSE, _CELLS):
        row, column = np.divmod(np.arange(cells**2), cells)
        cell_size = size * (_CELLS / cells)
        middle = low + (np.stack([row, column], axis=1) + 0.5) * cell_size
        if cells == _CELLS:
            ratio = _CELLS // _COARSE
            parent = row // ratio * _COARSE + column // ratio
        counts, listed = _list_near(middle, curve, float(np.hypot(*cell_size)), parent, first, listed)
        first = np.concatenate([[0], np.cumsum(counts)])
    return first, listed


@njit(cache=True, nogil=True)
def _segment_off(z: float, r: float, curve: Floats, i: int) -> tuple[float, float]:
    """Squared distance from (z, r) to segment i, and where along it the nearest point is, 0 to 1."""
    az, ar = curve[i, 0], curve[i, 1]
    dz, dr = curve[i + 1, 0] - az, curve[i + 1, 1] - ar
    along = ((z - az) * dz + (r - ar) * dr) / (dz * dz + dr * dr)
    along = min(max(along, 0.0), 1.0)
    return (z - az - along * dz) ** 2 + (r - ar - along * dr) ** 2, along


@njit(cache=True, nogil=True)
def _appended(listed: Ints, used: int, one: int) -> Ints:
    """The list with one more behind those used; one twice as long when it is full."""
    if used == len(listed):
        listed = np.concatenate((listed, np.empty_like(listed)))
    listed[used] = one
    return listed


@njit(cache=True, nogil=True)
def _list_near(
    middle: Floats, curve: Floats, reach: float, parent: Ints, first: Ints, choice: Ints
) -> tuple[Ints, Ints]:
    """Per cell the segments of its parent's choice no farther than the nearest one and ``reach``."""
    counts = np.zeros(len(middle), np.int64)
    listed = np.empty(4096, np.int64)
    used = 0
    distances = np.empty(len(curve))
    for cell in range(len(middle)):
        chosen = choice[first[parent[cell]] : first[parent[cell] + 1]]
        limit = np.inf
        for k in range(len(chosen)):
            distances[k] = np.sqrt(_segment_off(middle[cell, 0], middle[cell, 1], curve, chosen[k])[0])
            limit = min(limit, distances[k] + reach)
        for k in range(len(chosen)):
            if distances[k] <= limit:
                listed = _appended(listed, used, chosen[k])
                used += 1
                counts[cell] += 1
    return counts, listed[:used]


@njit(cache=True, nogil=True)
def _signed_distances(
    zr: Floats, curve: Floats, vertex_normals: Floats, low: Floats, size: Floats, first: Ints, listed: Ints
) -> Floats:
    result = np.empty(len(zr))
    everything = np.arange(len(curve) - 1)
    for n in range(len(zr)):
        z, r = zr[n, 0], zr[n, 1]
        row, column = np.floor((z - low[0]) / size[0]), np.floor((r - low[1]) / size[1])
        if len(listed) and 0 <= row < _CELLS and 0 <= column < _CELLS:
            cell = int(row) * _CELLS + int(column)
            nearby = listed[first[cell] : first[cell + 1]]
        else:
            nearby = everything
        best, best_i, best_along = np.inf, 0, 0.0
        for i in nearby:
            squared, along = _segment_off(z, r, curve, i)
            if squared < best:
                best, best_i, best_along = squared, i, along
        az, ar = curve[best_i, 0], curve[best_i, 1]
        dz, dr = curve[best_i + 1, 0] - az, curve[best_i + 1, 1] - ar
        nz, nr = -dr, dz
        if best_along == 0.0:
            nz, nr = vertex_normals[best_i, 0], vertex_normals[best_i, 1]
        elif best_along == 1.0:
            nz, nr = vertex_normals[best_i + 1, 0], vertex_normals[best_i + 1, 1]
        side = (z - az - best_along * dz) * nz + (r - ar - best_along * dr) * nr
        result[n] = np.sqrt(best) if side >= 0.0 else -np.sqrt(best)
    return result
