"""The residual field: deviation from the generatrix over arc length and angle, with its local noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from burrscan.arrays import Bools, Floats, Ints32
from burrscan.axis.basis import T_part_mesh
from burrscan.generatrix.cells import arc_of
from burrscan.generatrix.deviation import feet_of
from burrscan.generatrix.polyline import Foot, Polyline, polyline_of
from burrscan.generatrix.profile import Profile, profile_of
from burrscan.inspection import Axis, Generatrix

_CLIP = 6.0
"""A vertex counts for this many sigma at most, so that a spike is no burr."""
_VERTICES_ACROSS = 1.5
"""Side of a cell of the field, in vertex spacings."""
_MOST_CELLS = 4_000_000


@dataclass(frozen=True)
class Field:
    """Deviations of the vertices that have one, and the same in cells of (arc length, angle).

    Parameters
    ----------
    along_mm, angle, deviation_mm, sigma_mm
        (N,) arc length along the generatrix, angle in the part frame (radians), deviation less the background,
        and local noise of each vertex.
    foot
        (N, 2) nearest place (z, r) on the generatrix.
    normal
        (N, 2) outward normal (z, r) there.
    cell
        (N, 2) row and column of each vertex in the grid.
    step_mm, step_rad
        Size of a cell along the curve and around.
    arc
        (start, extent) of the angles, radians; a whole turn closes on itself.
    count, score
        (rows, columns) vertices per cell, and the sum of their deviations in units of their noise, clipped.

    """

    along_mm: Floats
    angle: Floats
    deviation_mm: Floats
    sigma_mm: Floats
    foot: Floats
    normal: Floats
    cell: Ints32
    step_mm: float
    step_rad: float
    arc: tuple[float, float]
    count: Floats
    score: Floats

    @property
    def spacing_mm(self) -> float:
        """Distance between neighbouring vertices."""
        return self.step_mm / _VERTICES_ACROSS

    @property
    def closed(self) -> bool:
        """Whether the field goes all the way round."""
        return self.arc[1] >= 2.0 * np.pi - 1e-9


def field_of(
    vertices_mm: Floats, axis: Axis, generatrix: Generatrix, *, sigma_mm: Floats | float | None
) -> Field:
    """Compute the residual field. O(V + cells)."""
    profile = profile_of(vertices_mm, axis)
    line = polyline_of(generatrix)
    foot = feet_of(profile, line)
    return _gridded(profile, line, foot, _stated(sigma_mm, foot.valid))


def _stated(sigma_mm: Floats | float | None, valid: Bools) -> Floats:
    """(N,) stated noise of the vertices that have a foot; zero where none is stated."""
    given = np.broadcast_to(np.asarray(0.0 if sigma_mm is None else sigma_mm, dtype=np.float64), valid.shape)
    return np.nan_to_num(given[valid])


def _gridded(profile: Profile, line: Polyline, foot: Foot, stated: Floats) -> Field:
    valid = foot.valid
    segment, t = foot.segment[valid], foot.t[valid]
    place = line.nodes_mm[line.starts[segment]] + t[:, None] * line.steps_mm[segment]
    along = line.along_mm[segment] + t * line.lengths_mm[segment]
    angle, deviation = profile.angle[valid], foot.distance_mm[valid]
    arc = arc_of(angle)
    if arc[1] > 1.97 * np.pi:
        arc = (-np.pi, 2.0 * np.pi)
    step_mm, step_rad, shape = _steps(line, arc, len(angle))
    row = np.minimum((along / step_mm).astype(np.int32), shape[0] - 1)
    turn = np.mod(angle - arc[0], 2.0 * np.pi)
    column = np.minimum((turn / step_rad).astype(np.int32), shape[1] - 1)
    normal = line.normals[segment]
    deviation = levelled(deviation, row, angle, place, normal, shape[0])
    sigma = np.maximum(local_noise(deviation, row, column, shape, step_rad), stated)
    cell = np.stack([row, column], axis=1)
    count, score = _summed(deviation, sigma, cell, shape)
    return Field(along, angle, deviation, sigma, place, normal, cell, step_mm, step_rad, arc, count, score)


def _steps(line: Polyline, arc: tuple[float, float], vertices: int) -> tuple[float, float, tuple[int, int]]:
    """Cell sizes for about two vertices a cell, and the grid's shape."""
    radius = line.nodes_mm[line.starts, 1] + 0.5 * line.steps_mm[:, 1]
    total = float(line.lengths_mm.sum())
    area = float((line.lengths_mm * radius).sum()) * arc[1]
    side = _VERTICES_ACROSS * np.sqrt(area / max(vertices, 1))
    side = max(side, np.sqrt(area / _MOST_CELLS))
    step_rad = side / (area / (total * arc[1]))
    shape = (max(int(np.ceil(total / side)), 1), max(int(np.ceil(arc[1] / step_rad)), 1))
    return total / shape[0], arc[1] / shape[1], shape


@njit(cache=True, nogil=True)
def _summed(deviation: Floats, sigma: Floats, cell: Ints32, shape: tuple[int, int]) -> tuple[Floats, Floats]:
    count, score = np.zeros(shape), np.zeros(shape)
    for i in range(len(deviation)):
        z = min(max(deviation[i] / sigma[i], -_CLIP), _CLIP)
        count[cell[i, 0], cell[i, 1]] += 1.0
        score[cell[i, 0], cell[i, 1]] += z
    return count, score


def levelled(
    deviation: Floats, row: Ints32, angle: Floats, place: Floats, normal: Floats, rows: int
) -> Floats:
    """Deviations less the median of their row and less what a small rigid motion of the axis explains.

    An axis slightly off leaves waves cos(angle), sin(angle), with the lever of the place along the axis; they
    are no burrs. Robust least squares (Tukey weights) of the four parameters. O(N).
    """
    level = deviation - grouped_median(deviation, row, rows)[row]
    scale = 1.4826 * float(np.median(np.abs(level))) + 1e-12 * float(np.abs(place).max())
    lever = place[:, 0] * normal[:, 1] - place[:, 1] * normal[:, 0]
    for _ in range(2):
        matrix, right = _motion_equations(level, angle, normal[:, 1], lever, scale)
        ridge = 1e-6 * np.trace(matrix) * np.eye(4) + 1e-300 * np.eye(4)
        motion = np.linalg.solve(matrix + ridge, right)
        level = level - (
            (normal[:, 1] * motion[0] + lever * motion[2]) * np.cos(angle)
            + (normal[:, 1] * motion[1] + lever * motion[3]) * np.sin(angle)
        )
        level = level - grouped_median(level, row, rows)[row]
    return level


@njit(cache=True, nogil=True)
def _motion_equations(
    level: Floats, angle: Floats, radial: Floats, lever: Floats, scale: float
) -> tuple[Floats, Floats]:
    matrix, right = np.zeros((4, 4)), np.zeros(4)
    basis = np.empty(4)
    for i in range(len(level)):
        x = level[i] / (4.685 * scale)
        if not -1.0 < x < 1.0:
            continue
        w = (1.0 - x * x) ** 2
        c, s = np.cos(angle[i]), np.sin(angle[i])
        basis[0], basis[1], basis[2], basis[3] = radial[i] * c, radial[i] * s, lever[i] * c, lever[i] * s
        for j in range(4):
            right[j] += w * basis[j] * level[i]
            for k in range(4):
                matrix[j, k] += w * basis[j] * basis[k]
    return matrix, right


def local_noise(
    deviation: Floats, row: Ints32, column: Ints32, shape: tuple[int, int], step_rad: float
) -> Floats:
    """(N,) robust standard deviation: of the row, times what the angular sector has more than others. O(N)."""
    size = np.abs(deviation)
    by_row = 1.4826 * grouped_median(size, row, shape[0])
    overall = 1.4826 * float(np.median(size))
    by_row = np.maximum(_widest(by_row), 0.3 * overall + 1e-9)
    wide = max(int(np.radians(10.0) / step_rad), 1)
    sector = column // wide
    ratio = grouped_median(size / by_row[row], sector, shape[1] // wide + 1) * 1.4826
    sigma: Floats = by_row[row] * np.maximum(np.nan_to_num(ratio, nan=1.0), 0.5)[sector]
    return sigma


def _widest(values: Floats) -> Floats:
    """Each row's noise is at least its neighbours': a crease's noise leaks by a row."""
    known = np.nan_to_num(values)
    padded = np.pad(known, 1, mode="edge")
    widest: Floats = np.maximum(known, np.minimum(np.maximum(padded[:-2], padded[2:]), 3.0 * known + 1e-300))
    return widest


@njit(cache=True, nogil=True)
def grouped_median(values: Floats, group: Ints32, groups: int) -> Floats:
    """Median of the values of each group, NaN for an empty one. O(N)."""
    first = np.zeros(groups + 1, np.int64)
    for g in group:
        first[g + 1] += 1
    first = np.cumsum(first)
    at = first[:-1].copy()
    ordered = np.empty(len(values))
    for i in range(len(values)):
        ordered[at[group[i]]] = values[i]
        at[group[i]] += 1
    median = np.full(groups, np.nan)
    for g in range(groups):
        if first[g + 1] > first[g]:
            median[g] = np.median(ordered[first[g] : first[g + 1]])
    return median


def to_mesh(z: float, r: float, angle: float, axis: Axis) -> Floats:
    """A point given in cylindrical coordinates about the axis, in the frame of the mesh, (3,)."""
    transform = T_part_mesh(axis.point_mm, axis.direction)
    part = np.array([r * np.cos(angle), r * np.sin(angle), z])
    point: Floats = transform[:3, :3].T @ (part - transform[:3, 3])
    return point
