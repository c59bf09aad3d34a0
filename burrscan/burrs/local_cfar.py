"""Whether an anomaly stands out from what surrounds it, and is one of its own.

Scans of real surfaces are not only noisy: edges smear, light bounces, patterns ripple. Where such errors are
of the same size as an anomaly all around it, or all the way round on its row, it is one of them (radar's
ordered-statistic constant-false-alarm-rate rule, Rohling 1983). And beside a burr there are shadows and
halos.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import ndimage

from burrscan.arrays import Bools, Floats, Ints
from burrscan.burrs.detect import Region, connected, widened
from burrscan.burrs.field import Field

_RANK = 0.9
"""The surroundings are as strong as this quantile of them: what is so high on more than a tenth is ripple.
With 0.8 eight burrs two pixels wide stand out in all of four views (three of them in one), but so do
teeth of 1.5 mm every 7 mm, and grooves between lugs."""
_CREST = 0.95
"""Quantile of an anomaly's cells that is its crest: most of them are flank, and the highest is noise."""
_LEAST_CONTRAST = 2.5
"""Least ratio of an anomaly's crest (this quantile of it) to the strength of its surroundings."""
_ROWS, _COLUMNS = 8, 40
"""How far the surroundings reach, in cells."""
_ONE_FACE = np.cos(np.radians(60.0))
"""Of the angle to the mean normal of an anomaly's rows: on an edge it is half-way between both faces'."""
_FACED = np.pi / 3.0
"""How far round the wheel rows of one view are compared with, to either side: what faces its camera. An end
face goes all the way round; its far side is dark, and errs ten times as much and more."""
_GUARD = 3
"""Cells next to an anomaly are neither it nor its surroundings."""
_CORE = 0.3
"""Share of its highest box from which cells of an anomaly are its core."""
_PART = 0.5
"""Share of an anomaly that its core is at most: else the whole is as good."""
_WHOLE = 0.5
"""What covers more than this share of a row is part of the generatrix."""
_LEAST_VERTICES = 8
"""Rising vertices that a peak is read off: an 80 % point of fewer is one of them."""
_SATELLITE = 0.5
"""Share of a neighbour's height, or of its evidence, below which an anomaly is its halo or its shadow."""
_HALO_MM = 2.5
"""How far from a burr its halo and its shadow reach."""


def convincing(field: Field, regions: list[Region], *, cores: bool = False) -> list[Region]:
    """The regions that stand out from their surroundings, in their order. O(V) for each.

    What stands out is no measure of the noise around the others: it is taken out of their surroundings, the
    highest first (the censored rule, Rickard & Dillard 1977). Else a burr beside higher ones would be lost.

    Where a region does not, its core may (``cores``): in scans of metal waves join a burr to much else. And
    the far side of what a scan sees is no measure of the near one.
    """
    peaks = [peak_mm(field, region) for region in regions]
    taken = np.zeros(field.count.shape, np.bool_)
    chosen: dict[int, Region] = {}
    for number in sorted(range(len(regions)), key=peaks.__getitem__, reverse=True):
        found: Region | None = regions[number]
        if not stands_out(field, regions[number], peaks[number], without=taken, faced=cores):
            found = _core(field, regions[number]) if cores else None
            if found and not stands_out(field, found, peak_mm(field, found), without=taken, faced=cores):
                found = None
        if found:
            taken |= widened(found.cells, _GUARD, _GUARD, closed=field.closed)
            chosen[number] = found
    return [chosen[number] for number in sorted(chosen)]


def _core(field: Field, region: Region) -> Region | None:
    """What is high of an anomaly, in one piece; None where that is most of it.

    Where noise is low next to waves that the surface has, cells of these are as significant as a burr's, and
    join it to an anomaly of which it is a small part.
    """
    rows = np.flatnonzero(region.cells.any(axis=1))
    span = (int(rows[0]), int(rows[-1]) + 1)
    level = region.sign * _box_means(field, np.inf, _judged(region), span)
    level[~region.cells | np.isnan(level)] = -np.inf
    cells = connected(level > _CORE * level.max(), closed=field.closed)
    core = (cells == cells.flat[int(level.argmax())]) & (cells > 0)
    if core.sum() > _PART * region.cells.sum() or len(field.within(core)) < _LEAST_VERTICES:
        return None
    return replace(region, cells=core)


def peak_mm(field: Field, region: Region) -> float:
    """How high the anomaly is where it is high: the 80 % point of its vertices' deviations."""
    lift = region.sign * field.deviation_mm[field.within(region.cells)]
    rising = lift[lift > 0.0]
    return float(np.quantile(rising, 0.8)) if len(rising) >= _LEAST_VERTICES else 0.0


def stands_out(field: Field, region: Region, peak: float, *, without: Bools, faced: bool) -> bool:
    """Whether an anomaly is clearly higher than nine tenths of what is around it, ``without`` some cells.

    Of one view what is ``faced`` together with it counts, of a mesh what is on its rows all the way round.
    """
    if peak <= 0.0:
        return False
    rows = np.flatnonzero(region.cells.any(axis=1))
    along = region.cells[rows].sum() / max(int((field.count[rows] > 0.0).sum()), 1)
    if along > _WHOLE:
        return False
    span = (max(int(rows[0]) - _ROWS, 0), min(int(rows[-1]) + _ROWS + 1, len(field.count)))
    around, beside = (cells & ~without for cells in _surroundings(field, region, faced=faced))
    faces = around, around & _of_one_face(field, rows)[:, None]

    def in_contrast(box: tuple[int, int]) -> bool:
        level = _box_means(field, 2.0 * peak, box, span)
        inside = region.cells & np.isfinite(level)
        if not inside.any():
            return False
        height = float(np.quantile(region.sign * level[inside], _CREST))
        # A ridge that crosses one bad row (a step's edge) is judged by the many others.
        on_rows = float(np.quantile(_row_strengths(level[rows], beside[rows]), 0.7))
        beyond = min(_strength(level, cells) for cells in faces)
        return height > _LEAST_CONTRAST * max(beyond, on_rows)

    return any(in_contrast(box) for box in _boxes(region))


def _boxes(region: Region) -> set[tuple[int, int]]:
    """Boxes by whose means an anomaly is judged: that which found it, of 3 × 3 cells at most, and others.

    A burr along the generatrix is often two pixels wide: in a box three cells wide it is half as high, and
    which box found it is chance. One around the axis may be as low as the noise of three cells.
    """
    rows, columns = _judged(region)
    return {(rows, columns), (rows, 1), (rows, min(region.box[1], 9))}


def _judged(region: Region) -> tuple[int, int]:
    return min(region.box[0], 3), min(region.box[1], 3)


def _strength(level: Floats, mask: Bools) -> float:
    known = np.abs(level[mask & np.isfinite(level)])
    return float(np.quantile(known, _RANK)) if len(known) > 20 else 0.0


def _row_strengths(level: Floats, mask: Bools) -> Floats:
    """:func:`_strength` of every row."""
    known = mask & np.isfinite(level)
    ordered = np.sort(np.where(known, np.abs(level), np.inf), axis=1)
    count = np.count_nonzero(known, axis=1)
    rank = np.maximum(np.ceil(_RANK * count).astype(np.int64) - 1, 0)
    return np.where(count > 20, np.take_along_axis(ordered, rank[:, None], axis=1)[:, 0], 0.0)


def _of_one_face(field: Field, rows: Ints) -> Bools:
    """(rows,) True for those that look as some of them do: past an edge another face errs as it is lit."""
    normal = field.row_normal
    near: Bools = normal @ normal[rows].sum(axis=0) > _ONE_FACE * len(rows)
    return near


def _surroundings(field: Field, region: Region, *, faced: bool) -> tuple[Bools, Bools]:
    """Cells around the region, and cells of its rows, all round or on its side, both without its own."""
    own = widened(region.cells, _GUARD, _GUARD, closed=field.closed)
    around = boxed(region.cells, _ROWS, _COLUMNS, closed=field.closed)
    reach = int(_FACED / field.step_rad) if faced else own.shape[1]
    beside = boxed(region.cells, 0, reach, closed=field.closed)
    return around & ~own, beside & ~own


def boxed(cells: Bools, rows: int, columns: int, *, closed: bool) -> Bools:
    """The box around some cells, grown by so many rows and columns to every side."""
    used_rows: Bools = np.logical_or.reduce(cells, axis=1)
    used_columns: Bools = np.logical_or.reduce(cells, axis=0)
    return _stretched(used_rows, rows, wrap=False)[:, None] & _stretched(used_columns, columns, wrap=closed)


def _stretched(used: Bools, by: int, *, wrap: bool) -> Bools:
    """A mask grown by ``by`` to both sides."""
    by = min(by, len(used) - 1)
    padded = np.pad(used, by, mode="wrap" if wrap else "constant")
    total = np.concatenate([[0], np.cumsum(padded)])
    grown: Bools = total[2 * by + 1 :] > total[: -2 * by - 1]
    return grown


def _box_means(field: Field, most: float, box: tuple[int, int], span: tuple[int, int]) -> Floats:
    """Mean deviation, each cut off at ``most``, over a box of cells; NaN with fewer than two vertices.

    Only the rows of ``span`` are computed: O(vertices and cells in them).
    """
    count = field.count
    reach = slice(max(span[0] - box[0] // 2, 0), min(span[1] + box[0] // 2, len(count)))
    near = field.in_rows(reach.start, reach.stop)
    part = count[reach]
    flat = field.flat_cell[near] - reach.start * count.shape[1]
    cut = np.clip(field.deviation_mm[near], -most, most)
    total = np.asarray(np.bincount(flat, cut, part.size), np.float64).reshape(part.shape)
    sums = []
    for image in (part, total):
        for axis in (0, 1):
            size = 2 * (box[axis] // 2) + 1
            image = ndimage.convolve1d(image, np.ones(size), axis=axis, mode="constant")  # noqa: PLW2901
        sums.append(image)
    level = np.full(count.shape, np.nan)
    enough = sums[0] >= 2.0
    level[reach][enough] = sums[1][enough] / sums[0][enough]
    level[: span[0]], level[span[1] :] = np.nan, np.nan
    return level


def without_satellites(field: Field, regions: list[Region], certain: list[float]) -> list[int]:
    """Numbers of the regions that are no halo and no shadow of another.

    Light that bounces at the foot of a burr digs a dip beside it, and the wall of a nick smears into a ridge.
    Of two beside each other the one less than half as high is the other's halo; else the one with less
    evidence, certainty over its area, is its shadow. Two burrs of the same sign may well stand side by side:
    there the shadow has less than half of the evidence. O(cells) for each, and its own cells for each pair.
    """
    reach = max(int(np.ceil(_HALO_MM / field.step_mm)), _GUARD)
    around = [widened(region.cells, reach, reach, closed=field.closed).ravel() for region in regions]
    own = [np.flatnonzero(region.cells) for region in regions]
    peak = [peak_mm(field, region) for region in regions]
    evidence = [sure * float(np.sqrt(len(cells))) for sure, cells in zip(certain, own, strict=True)]

    def satellite(i: int, j: int) -> bool:
        if i == j or peak[j] < _SATELLITE * peak[i]:
            return False
        if np.count_nonzero(around[j][own[i]]) <= 0.5 * len(own[i]):
            return False
        odds = _SATELLITE if regions[i].sign == regions[j].sign else 1.0
        return peak[i] < _SATELLITE * peak[j] or evidence[i] < odds * evidence[j]

    numbers = range(len(regions))
    return [i for i in numbers if not any(satellite(i, j) for j in numbers)]
