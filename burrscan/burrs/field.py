"""The residual field: deviation from the generatrix over arc length and angle, with its local noise."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from burrscan.arrays import Bools, Floats, Ints, Ints32
from burrscan.axis.basis import T_part_mesh
from burrscan.burrs.bodies import TALLEST_MM, of_another_body, tallest
from burrscan.burrs.noise.border import border_spread_mm, deep, inner
from burrscan.burrs.noise.sigma_calibration import calibrated
from burrscan.burrs.noise.waves import without_waves
from burrscan.burrs.pitch import pitches_mm
from burrscan.burrs.sheets import of_another_surface
from burrscan.errors import InputError
from burrscan.generatrix.deviation import feet_of, further_than, past_ends
from burrscan.generatrix.polyline import Foot, Polyline, polyline_of
from burrscan.generatrix.profile import Profile, profile_of
from burrscan.generatrix.tracing.cells import arc_of, past_start
from burrscan.inspection import Axis, Generatrix
from burrscan.pose import placed
from burrscan.robust import SIGMA_PER_MEDIAN

CLIP = 6.0
"""A vertex counts for this many sigma at most, so that a spike is no burr."""
_VERTICES_ACROSS = 1.5
"""Side of a cell of the field, in vertex spacings."""
_MOST_CELLS = 4_000_000
"""Bounds memory: a few images of 8 bytes a cell. Larger meshes get coarser cells, and narrow burrs fewer of
them."""
APART_CELLS = 27
"""Rows between pieces of the curve that lie as far apart or farther: as long as the longest box that is
matched, so that none holds vertices of two surfaces."""
_MOSTLY_FILLED = 0.7
"""Share of cells with a vertex: 2.25 random vertices a cell fill 89 %; much less, and part of the field is
unseen."""
_CORE = 2.5
"""Mean and spread are taken within this many sigma, where noise of any kind is bell-shaped."""
_CORE_SPREAD = 0.9113
"""Standard deviation of a Gaussian cut off at 2.5 sigma."""
_CORE_PASSES = 4
"""From three times the overall spread inwards; each pass cuts at the spread that the one before left."""
_SECTOR = np.radians(10.0)
"""Angle over which the noise is compared between parts of the arc."""
_QUIETEST = 0.3
"""A row is never taken to be quieter than this share of the whole."""
_FINEST_ROW = 60
"""Vertices that the level of a parallel takes."""
_MOST_PARTS = 8
"""Parallels per row of cells at most: bounds the time; finer ones only follow a finer error of the
generatrix."""
_FEWEST_LEVELLED = 8
"""Vertices of a parallel: the median of fewer is as uncertain as half of their noise, which it would add."""


@dataclass(frozen=True)
class Field:
    """Deviations of the vertices that have one, and the same in cells of (arc length, angle).

    Parameters
    ----------
    along_mm, angle, deviation_mm, sigma_mm
        (N,) arc length along the generatrix and the gaps between its pieces, angle in the part frame
        (radians), deviation less the background, and local noise of each vertex.
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
    local_mm
        (N,) noise that the data show around each vertex, whatever is stated of it.
    waves_mm
        (N,) by how much what was taken off as waves differs around each vertex, 0 where nothing was.
    stated_mm
        (N,) stated noise as it was given, 0 where none was.
    border
        (N,) True for vertices on the border of the mesh.
    vertex
        (N,) index of each in the mesh.
    without_curve
        (V,) True for the vertices of the mesh whose nearest place on the curve is an open end of it.
    joined
        (T, 3) triangles of the mesh between neighbours; none of a drawing, whose facets are no such.

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
    local_mm: Floats
    waves_mm: Floats
    stated_mm: Floats
    border: Bools
    vertex: Ints
    without_curve: Bools
    joined: Ints32

    @property
    def spacing_mm(self) -> float:
        """Distance between neighbouring vertices, on the whole."""
        return self.step_mm / _VERTICES_ACROSS

    @cached_property
    def pitch_mm(self) -> Floats:
        """(N, 2) distance to the next vertex along the curve and around, NaN for vertices in no triangle."""
        radius_mm, count = self.foot[:, 1], len(self.without_curve)
        return pitches_mm(self.along_mm, self.angle, radius_mm, self.joined, self.vertex, count=count)

    @cached_property
    def flat_cell(self) -> Ints:
        """(N,) index of each vertex's cell in the grid as one row after the other."""
        return np.ravel_multi_index((self.cell[:, 0], self.cell[:, 1]), self.count.shape)

    @cached_property
    def row_normal(self) -> Floats:
        """(rows, 2) mean outward normal (z, r) of each row's vertices, zero where it has none."""
        row, rows = self.cell[:, 0], len(self.count)
        sums = [np.bincount(row, one, rows) for one in self.normal.T]
        return np.stack(sums, axis=1) / np.maximum(np.bincount(row, minlength=rows), 1)[:, None]

    @cached_property
    def _by_row(self) -> tuple[Ints, Ints]:
        """(N,) vertices ordered by their row, and (rows + 1,) where in it each row begins."""
        order = np.argsort(self.cell[:, 0], kind="stable")
        return order, np.searchsorted(self.cell[order, 0], np.arange(len(self.count) + 1))

    def in_rows(self, first: int, end: int) -> Ints:
        """(M,) vertices in the rows from ``first`` to before ``end``, a row after the other.

        O(1) once the vertices are ordered, O(N log N), which the first call does.
        """
        order, starts = self._by_row
        return order[starts[first] : starts[end]]

    def within(self, cells: Bools) -> Ints:
        """(M,) vertices in some cells (rows, columns), ascending. O(vertices in the rows of the cells)."""
        rows = np.flatnonzero(np.logical_or.reduce(cells, axis=1))
        if not len(rows):
            return rows
        near = self.in_rows(int(rows[0]), int(rows[-1]) + 1)
        inside: Bools = cells.ravel().take(self.flat_cell[near])  # a quarter of the time of two indices
        return np.sort(near[inside])

    def arc_mm(self, chosen: Ints) -> Floats:
        """(M,) length around the axis, from the start of the arc, of some vertices."""
        turn = (self.angle[chosen] - self.arc[0]) % (2.0 * np.pi)
        return np.asarray(turn * self.foot[chosen, 1])

    @property
    def closed(self) -> bool:
        """Whether the field goes all the way round."""
        return _closed(self.arc)


def _closed(arc: tuple[float, float]) -> bool:
    return arc[1] >= 2.0 * np.pi - 1e-9


def field_of(
    vertices_mm: Floats,
    faces: Ints32,
    axis: Axis,
    generatrix: Generatrix,
    *,
    sigma_mm: Floats | float | None,
    tallest_mm: float | None = None,
) -> Field:
    """Compute the residual field; border vertices have a noise class of their own. O(V + T).

    What runs on further than ``tallest_mm`` is left out with its foot; see :mod:`burrscan.burrs.bodies`.

    Raises
    ------
    InputError
        Where no vertex lies near the generatrix.

    """
    profile = profile_of(vertices_mm, axis)
    line = polyline_of(generatrix)
    foot = feet_of(profile.z_mm, profile.r_mm, line)
    if tallest_mm is None:
        tallest_mm = tallest(TALLEST_MM, float(line.nodes_mm[:, 1].max()), scanned=True)
    beyond = further_than(tallest_mm, profile.z_mm, profile.r_mm, line, foot)
    valid = foot.valid & ~_strangers(vertices_mm, faces, axis, line, foot)
    valid &= ~of_another_body(faces, foot.distance_mm, beyond)
    if not valid.any():
        raise InputError("no vertex lies near the generatrix: hand over axis and generatrix of this mesh")
    known = Foot(foot.segment[valid], foot.t[valid], foot.distance_mm[valid])
    stated = np.broadcast_to(np.asarray(0.0 if sigma_mm is None else sigma_mm, np.float64), valid.shape)
    inside = inner(faces, len(vertices_mm))
    even = _evenly_spread(faces, len(vertices_mm))
    return _gridded(
        line,
        known,
        profile.angle[valid],
        np.nan_to_num(stated[valid]),
        inside[valid],
        deep(faces, inside)[valid],
        even[valid],
        _finest(profile),
        vertex=np.flatnonzero(valid),
        without_curve=past_ends(profile.z_mm, profile.r_mm, line, foot),
        joined=faces if even.all() else faces[:0],
    )


def _strangers(vertices_mm: Floats, faces: Ints32, axis: Axis, line: Polyline, foot: Foot) -> Bools:
    """(V,) True for vertices near the curve of a surface that is not theirs."""
    transform = T_part_mesh(axis.point_mm, axis.direction)
    part = placed(transform, vertices_mm)
    normal = line.normals[np.maximum(foot.segment, 0)]
    return of_another_surface(part, faces, normal, foot.distance_mm)


def _finest(profile: Profile) -> float:
    """Noise that rounding alone causes at this distance from the axis."""
    return 1e-9 * float(np.nanmax(profile.r_mm)) + 1e-300


def _gridded(
    line: Polyline,
    foot: Foot,
    angle: Floats,
    stated: Floats,
    counts: Bools,
    deep_in: Bools,
    even: Bools,
    finest: float,
    *,
    vertex: Ints,
    without_curve: Bools,
    joined: Ints32,
) -> Field:
    arc = arc_of(angle)
    if arc[1] > 1.97 * np.pi:
        arc = (-np.pi, 2.0 * np.pi)
    step_mm, step_rad, shape = _steps(line, arc, len(angle))
    place, normal = line.places_mm(foot.segment, foot.t), line.normals[foot.segment]
    along, cell = _cells(line, foot, angle, arc, (step_mm, step_rad), shape)
    filled = _filled(cell, line, step_mm, shape)
    if filled < _MOSTLY_FILLED:
        # Most of the field is hidden from this view: what is seen is sampled more finely than thought.
        step_mm, step_rad, shape = _steps(line, arc, round(len(angle) / filled))
        along, cell = _cells(line, foot, angle, arc, (step_mm, step_rad), shape)
    deviation, spread = levelled(foot.distance_mm, cell, place, normal, shape, arc, finest)
    sector = cell[:, 1] // max(round(_SECTOR / step_rad), 1)
    deviation = _flattened(deviation, along, step_mm, cell[:, 0], sector, spread, even)
    waves = np.zeros(len(deviation))
    if even.all():  # a drawing has no noise
        apart = without_waves(deviation, cell, shape, step_mm=step_mm, closed=_closed(arc))
        if apart is not None:
            left, waves = apart
            deviation, spread = levelled(left, cell, place, normal, shape, arc, finest)
    local = _local_noise(deviation, cell[:, 0], sector, spread)
    sigma = np.maximum(local, calibrated(stated, deviation))
    # what stands up on an edge and is off the border by more than one vertex does not follow it: it is a burr
    doubtful = ~((deep_in & (deviation > 0.0)) | (counts & _mostly(counts, cell, shape[0])))
    sigma[doubtful] = np.maximum(sigma[doubtful], border_spread_mm(deviation[doubtful]))
    flat = np.ravel_multi_index((cell[:, 0], cell[:, 1]), shape)
    count = summed(np.ones(len(flat)), flat, shape)
    score = summed(np.clip(deviation / sigma, -CLIP, CLIP), flat, shape)
    return Field(
        along,
        angle,
        deviation,
        sigma,
        place,
        normal,
        cell,
        step_mm,
        step_rad,
        arc,
        count,
        score,
        local,
        waves,
        stated,
        doubtful,
        vertex,
        without_curve,
        joined,
    )


def _steps(line: Polyline, arc: tuple[float, float], vertices: int) -> tuple[float, float, tuple[int, int]]:
    """Cell sizes for about two vertices a cell, and the grid's shape."""
    radius = line.nodes_mm[line.starts, 1] + 0.5 * line.steps_mm[:, 1]
    total = float(line.lengths_mm.sum())
    area = float((line.lengths_mm * radius).sum()) * arc[1]
    side = max(_VERTICES_ACROSS * np.sqrt(area / max(vertices, 1)), np.sqrt(area / _MOST_CELLS))
    turn = side / (area / (total * arc[1]))
    step = total / max(int(np.ceil(total / side)), 1)
    whole = float(line.apart_mm(APART_CELLS * step)[-1] + line.lengths_mm[-1])
    columns = max(int(np.ceil(arc[1] / turn)), 1)
    return step, arc[1] / columns, (int(np.ceil(whole / step - 1e-9)), columns)


def _cells(
    line: Polyline,
    foot: Foot,
    angle: Floats,
    arc: tuple[float, float],
    steps: tuple[float, float],
    shape: tuple[int, int],
) -> tuple[Floats, Ints32]:
    """Arc length, and row and column, of every vertex."""
    step_mm, step_rad = steps
    along = line.apart_mm(APART_CELLS * step_mm)[foot.segment] + foot.t * line.lengths_mm[foot.segment]
    turn = past_start(angle, arc)
    row = np.minimum((along / step_mm).astype(np.int32), shape[0] - 1)
    return along, np.stack([row, np.minimum((turn / step_rad).astype(np.int32), shape[1] - 1)], axis=1)


def _mostly(counts: Bools, cell: Ints32, rows: int) -> Bools:
    """(N,) True in rows most of whose vertices count: the others follow an edge all the way round."""
    every = np.bincount(cell[:, 0], minlength=rows)
    good = np.bincount(cell[:, 0], weights=counts, minlength=rows)
    most: Bools = (2.0 * good >= every)[cell[:, 0]]
    return most


def _filled(cell: Ints32, line: Polyline, step_mm: float, shape: tuple[int, int]) -> float:
    """Share of the curve's cells that hold a vertex."""
    used = np.zeros(shape, np.bool_)
    used[cell[:, 0], cell[:, 1]] = True
    rows = max(float(line.lengths_mm.sum()) / step_mm, 1.0)
    return max(float(used.sum()) / (rows * shape[1]), 0.02)


def levelled(
    deviation: Floats,
    cell: Ints32,
    place: Floats,
    normal: Floats,
    shape: tuple[int, int],
    arc: tuple[float, float],
    finest: float,
) -> tuple[Floats, Floats]:
    """Deviations less the level of their row, and less what a small rigid motion of the axis explains.

    An axis slightly off leaves waves cos(angle), sin(angle), with the lever of the place along the axis; they
    are no burrs. Least squares of the four parameters over the core of the data. O(N).

    Returns
    -------
    tuple
        (N,) deviations and (rows,) robust standard deviations.

    """
    overall = SIGMA_PER_MEDIAN * float(np.median(np.abs(deviation))) + finest
    mean, spread = core_of(deviation, cell, shape[0], overall)
    # About the middle of the data: about the part frame's origin, which may be far away, a tilt is a shift.
    place = place - [float(place[:, 0].mean()), 0.0]
    basis = _motion_basis(cell, place, normal, arc[0] + (np.arange(shape[1]) + 0.5) * arc[1] / shape[1])
    matrix, right = _motion_equations(deviation, cell[:, 0], basis, mean, spread)
    if right.any():
        deviation = deviation - np.linalg.lstsq(matrix, right, rcond=1e-10)[0] @ basis
    mean, spread = core_of(deviation, cell, shape[0], overall)
    deviation = deviation - mean[cell[:, 0]]
    return deviation, np.maximum(spread, _QUIETEST * overall)


def _evenly_spread(faces: Ints32, count: int) -> Bools:
    """(count,) True for the vertices that lie as densely everywhere.

    All of a scan's. Of a drawing the samples of its facets, which no face names: its own vertices crowd on
    the outlines of its burrs, row by row.
    """
    samples = np.ones(count, np.bool_)
    samples[faces.ravel()] = False
    return samples if 2 * np.count_nonzero(samples) > count and len(faces) else np.ones(count, np.bool_)


def _flattened(
    deviation: Floats,
    along: Floats,
    step_mm: float,
    row: Ints32,
    sector: Ints32,
    spread: Floats,
    even: Bools,
) -> Floats:
    """Deviations less the level of their parallel, which is finer than a row where there are many vertices.

    What is common to a parallel is the generatrix's error, not a burr: edges of the part are rounded off
    within less than a row.
    """
    used = np.unique(row)
    parts = int(np.clip(len(deviation) / (len(used) * _FINEST_ROW), 1, _MOST_PARTS))
    parallel = np.minimum((along * (parts / step_mm)).astype(np.int32), parts * len(spread) - 1)
    near = 3.0 * _CORE * float(np.median(spread[used]))
    level = _levels(deviation[even], parallel[even], sector[even], parts, parts * len(spread), near)
    return np.asarray(deviation - level[parallel])


def _levels(values: Floats, parallel: Ints32, sector: Ints32, parts: int, count: int, near: float) -> Floats:
    """Level of every parallel: the median where most of its arc is not near 0, else 0. O(N log N).

    Every sector counts alike, and those that only the other ``parts`` of its row are seen in as near 0: a
    burr on an edge has the vertices of all its flanks above one parallel, more than the rest of it has.
    """
    sectors = np.int64(sector.max(initial=0)) + 1
    weight = 1.0 / _mates(parallel * sectors + sector)
    seen = np.unique((parallel // parts) * sectors + sector) // sectors
    every = np.repeat(np.bincount(seen, minlength=count // parts), parts)
    far = np.abs(values) > near
    off = np.bincount(parallel[far], weight[far], count)
    bad = (2.0 * off > every) & (np.bincount(parallel, minlength=count) >= _FEWEST_LEVELLED)
    level = np.zeros(count)
    own = np.flatnonzero(bad[parallel])
    own = own[np.argsort(parallel[own], kind="stable")]
    for each in np.split(own, np.flatnonzero(np.diff(parallel[own])) + 1) if len(own) else ():
        level[parallel[each[0]]] = np.quantile(values[each], 0.5, method="inverted_cdf", weights=weight[each])
    return level


def _mates(place: Ints) -> Ints:
    """(N,) how many are where each is, itself included."""
    return np.asarray(np.bincount(place)[place] if len(place) else place)


def core_of(values: Floats, cell: Ints32, rows: int, overall: float) -> tuple[Floats, Floats]:
    """Mean and standard deviation of each row's core, found from outside inwards. O(N)."""
    row = cell[:, 0]
    mean, spread = np.zeros(rows), np.full(rows, 3.0 * overall)
    for _ in range(_CORE_PASSES):
        x = values - mean[row]
        core = np.abs(x) <= _CORE * spread[row]
        count, total, square = (
            np.bincount(row[core], power, rows) for power in (None, x[core], x[core] ** 2)
        )
        enough = count > 7.0
        shift = total[enough] / count[enough]
        variance = np.maximum(square[enough] / count[enough] - shift * shift, 0.0)
        mean[enough] += shift
        spread[enough] = np.maximum(np.sqrt(variance) / _CORE_SPREAD, 1e-3 * overall)
    return mean, spread


def _motion_basis(cell: Ints32, place: Floats, normal: Floats, middle: Floats) -> Floats:
    """(4, N) change of the deviations by (shift along x, along y, tilt in xz, tilt in yz) of the axis."""
    lever = place[:, 0] * normal[:, 1] - place[:, 1] * normal[:, 0]
    cosine, sine = np.cos(middle)[cell[:, 1]], np.sin(middle)[cell[:, 1]]
    return np.stack([normal[:, 1] * cosine, normal[:, 1] * sine, lever * cosine, lever * sine])


def _motion_equations(
    deviation: Floats, row: Ints32, basis: Floats, mean: Floats, spread: Floats
) -> tuple[Floats, Floats]:
    """Normal equations of the motion of the axis over the core of the data, each row's mean eliminated."""
    x = deviation - mean[row]
    core = np.abs(x) <= 4.0 * spread[row]
    x, row, basis = x[core], row[core], basis[:, core]
    weighted = basis / spread[row] ** 2
    count = np.bincount(row, minlength=len(mean))
    sums = np.stack([np.bincount(row, one, len(mean)) for one in (*basis, x)])
    share = 1.0 / (spread**2 * np.maximum(count, 1))
    matrix = weighted @ basis.T - (share * sums[:4]) @ sums[:4].T
    return matrix, weighted @ x - (share * sums[:4]) @ sums[4]


def _local_noise(deviation: Floats, row: Ints32, sector: Ints32, spread: Floats) -> Floats:
    """(N,) standard deviation: of the row, times what the angular sector has more or less. O(N)."""
    z = deviation / spread[row]
    core = np.abs(z) < 2.0 * _CORE
    count, square = (np.bincount(sector[core], power, sector.max() + 1) for power in (None, z[core] ** 2))
    ratio = np.ones(len(count))
    known = count > 50.0
    ratio[known] = np.clip(np.sqrt(square[known] / count[known]), 0.5, 3.0)
    return np.asarray(spread[row] * ratio[sector])


def summed(values: Floats, flat_cell: Ints, shape: tuple[int, ...]) -> Floats:
    """(rows, columns) sum of the values (N,) in each cell."""
    return np.bincount(flat_cell, values, shape[0] * shape[1]).astype(np.float64).reshape(shape)
