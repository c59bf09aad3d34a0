"""Where the residual field holds more than noise: matched boxes of many shapes, calibrated on the data.

Every box's mean is compared with what boxes of its shape show along the same row of the field, all the way
round (their core, so that burrs do not count). Correlated noise and waviness raise the threshold of the
shapes that they resemble, and what repeats all the way round (a crease a little off) raises none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy import ndimage
from scipy.special import ndtri

from burrscan.arrays import Bools, Floats, Ints32
from burrscan.burrs.field import CLIP, Field, summed

BOXES = ((1, 3), (1, 9), (1, 27), (3, 9), (3, 27), (3, 3), (3, 1), (9, 1), (27, 1), (9, 3), (27, 3))
"""(rows, columns) of every matched box, in cells."""
_SMALL = BOXES.index((3, 3))
"""Index of the box of 3 × 3 cells, whose statistic says how far a burr's cells reach."""
_LEAST_VERTICES = 4
"""Of a region: its height, place, width and direction are four unknowns; from fewer vertices nothing is
known."""
_GROW = 2.5
"""A burr's cells reach out to where a box of 3 × 3 cells is this many sigma high."""
_EXPLAINED = 0.5
"""A box is explained by a stronger one inside it, where it is weaker than this share of that."""
_APART_CELLS, _APART_MM = 4, 3.0
"""How far from what the small box shows by itself an anomaly reaches: gaps of twice that (nine cells, as the
middle boxes are long, or 6 mm, as torn burrs have them) are within one burr, wider ones are between two."""
_COMPANY = 2.5
"""Vertices in a box of 3 × 3 cells that are further off than a vertex counts, itself one of them. Three are
no spikes: where one vertex in fifty is one, of some 20 in the box, one in sixty of these has two others."""
_PRIOR_POSITIONS = 20.0
"""A row's own spread counts against that of the whole field as if that were so many positions."""


@dataclass(frozen=True)
class Region:
    """Cells of one anomaly.

    Parameters
    ----------
    cells
        (rows, columns) True in it.
    sign
        +1 for material too much, -1 for material missing.
    significance
        Largest box statistic in it, in units of its noise.
    inflation
        How much larger than independent noise would give the spread of that box shape is there.
    box
        (rows, columns) of that box.

    """

    cells: Bools
    sign: int
    significance: float
    inflation: float
    box: tuple[int, int]


@dataclass(frozen=True)
class Evidence:
    """Per cell, the box statistic of largest size among the boxes centred there.

    Parameters
    ----------
    statistic, inflation
        (rows, columns) its value in units of its noise, and that noise against independent noise.
    shape
        (rows, columns) its number in :data:`BOXES`.
    small
        (rows, columns) the statistic of the 3 × 3 box.

    """

    statistic: Floats
    inflation: Floats
    shape: Ints32
    small: Floats


def threshold(cells: int, *, false_calls_per_wheel: float) -> float:
    """The box statistic that noise exceeds ``false_calls_per_wheel`` times on average.

    Independent tests are counted as three per box area, summed over shapes, both signs (Bonferroni).
    """
    tests = sum(3.0 * cells / (a * b) for a, b in BOXES)
    return float(-ndtri(min(false_calls_per_wheel / (2.0 * tests), 0.5)))


def regions(field: Field, *, false_calls_per_wheel: float) -> list[Region]:
    """Every anomaly of the field, most significant first. O(cells × shapes)."""
    limit = threshold(int((field.count > 0).sum()), false_calls_per_wheel=false_calls_per_wheel)
    evidence = evidence_of(field)
    found = []
    for sign in (1, -1):
        strong = sign * evidence.statistic > limit
        if strong.any():
            _explain(strong, sign * evidence.statistic, evidence.shape, np.array(BOXES))
            found += _labelled(strong, evidence, sign, field, limit)
    return sorted(found, key=lambda region: -region.significance)


def _between(plain: Bools, shape: Ints32, field: Field) -> Bools:
    """Cells whose boxes hold what is plain in small boxes, far from any that is: between burrs of an edge.

    A long box over the gap between two is as strong as one on half of a burr, and would join them. Along the
    generatrix it does not: on the sides of the steps that a burr crosses nothing of it may be seen.
    """
    reach = max(_APART_CELLS, int(np.ceil(_APART_MM / field.step_mm)))
    between = np.zeros_like(plain)
    for number, (a, b) in enumerate(BOXES):
        if b > a:
            between |= (shape == number) & widened(plain, a // 2, b // 2, closed=field.closed)
    return between & ~widened(plain, reach, reach, closed=field.closed)


def widened(cells: Bools, rows: int, columns: int, *, closed: bool) -> Bools:
    """Cells within so many rows and columns of the given ones. O(cells in the rows that are reached)."""
    grown, used = np.zeros_like(cells), np.flatnonzero(np.logical_or.reduce(cells, axis=1))
    if len(used):
        near = slice(max(int(used[0]) - rows, 0), int(used[-1]) + rows + 1)
        part, size = cells[near].astype(np.uint8), 2 * columns + 1
        across = ndimage.maximum_filter1d(part, size, axis=1, mode="wrap" if closed else "constant")
        grown[near] = ndimage.maximum_filter1d(across, 2 * rows + 1, axis=0, mode="constant") > 0
    return grown


def _labelled(strong: Bools, evidence: Evidence, sign: int, field: Field, limit: float) -> list[Region]:
    """Strong cells and what is high beside them, connected; in parts where a gap lies between these."""
    plain = sign * evidence.small > limit
    grown = strong | (sign * evidence.small > _GROW)
    labels = connected(grown, closed=field.closed)
    parts = connected(grown & ~_between(plain, evidence.shape, field), closed=field.closed)
    found = []
    statistic = sign * evidence.statistic
    for label in np.unique(labels[strong]):
        whole = labels == label
        apart = np.unique(parts[whole & strong & plain & (parts > 0)])
        for cells in (parts == part for part in apart) if len(apart) > 1 else (whole,):
            if field.count[cells].sum() >= _LEAST_VERTICES:
                peak = np.argmax(np.where(cells & strong, statistic, -np.inf))
                box = BOXES[int(evidence.shape.flat[peak])]
                noise = float(evidence.inflation.flat[peak])
                found.append(Region(cells, sign, float(statistic.flat[peak]), noise, box))
    return found


def connected(cells: Bools, *, closed: bool) -> Ints32:
    """Number of the connected cells that each is one of, 0 outside; on a closed field across its seam too."""
    labels: Ints32 = np.asarray(ndimage.label(cells, structure=np.ones((3, 3)))[0], dtype=np.int32)
    if closed:
        _sew(labels)
    return labels


def _sew(labels: Ints32) -> None:
    """Join the labels that meet across the seam of a closed field."""
    for row in range(len(labels)):
        left, right = labels[row, 0], labels[row, -1]
        if left and right and left != right:
            labels[labels == right] = left


@njit(cache=True, nogil=True, error_model="numpy")
def _explain(strong: Bools, statistic: Floats, shape: Ints32, boxes: Ints32) -> None:
    """Drop strong boxes that owe their strength to a much stronger one whose centre they hold."""
    height, width = strong.shape
    for i in range(height):
        for j in range(width):
            if not strong[i, j]:
                continue
            a, b = boxes[shape[i, j], 0] // 2 + 1, boxes[shape[i, j], 1] // 2 + 1
            around = statistic[max(i - a, 0) : min(i + a + 1, height), max(j - b, 0) : min(j + b + 1, width)]
            strong[i, j] = not statistic[i, j] < _EXPLAINED * around.max()


def evidence_of(field: Field) -> Evidence:
    """Match every box everywhere. O(V + cells × shapes).

    Where neighbours share their noise a box of n vertices varies by up to √n times what theirs is, and no sum
    of what counts for 6 sigma at most would stand out. There, where waves were taken off, vertices count for
    as many times more as a small box varies more, but only beside two others as far off: a spike stays one.
    Not elsewhere: what a part's own texture does to boxes looks alike.
    """
    evidence, spread = _matched(field, field.score)
    if not field.waves_mm.any():
        return evidence
    score = _in_company(field, spread)
    return evidence if score is None else _matched(field, score)[0]


def _in_company(field: Field, spread: Floats) -> Floats | None:
    """(rows, columns) scores in which vertices count for more in rows (rows,) of a larger spread.

    None where none does.
    """
    shape, score = field.count.shape, field.deviation_mm / field.sigma_mm
    far = np.zeros(len(score), np.bool_)
    for sign in (1.0, -1.0):
        beyond = sign * score > CLIP
        others = summed(beyond.astype(float), field.flat_cell, shape)
        others = ndimage.convolve1d(others, np.ones(3), axis=0, mode="constant")
        others = ndimage.convolve1d(others, np.ones(3), axis=1, mode="wrap" if field.closed else "constant")
        far |= beyond & (others.ravel()[field.flat_cell] > _COMPANY)
    most = np.where(far, CLIP * spread[field.cell[:, 0]], CLIP)
    return summed(np.clip(score, -most, most), field.flat_cell, shape) if (most > CLIP).any() else None


def _matched(field: Field, score: Floats) -> tuple[Evidence, Floats]:
    """The evidence of such scores, and by how much a small box varies in each row (rows,)."""
    columns = field.count.shape[1]
    wrap = min(max(b for _, b in BOXES) // 2, columns) if field.closed else 0
    images = [np.ascontiguousarray(_wrapped(image, wrap)) for image in (field.count, score)]
    mean = float(field.count[field.count > 0].mean()) if field.count.any() else 1.0
    best, inflation, shape, small, spread = _match(integral(images[0]), integral(images[1]), mean)
    inner = slice(wrap, wrap + columns)
    return Evidence(best[:, inner], inflation[:, inner], shape[:, inner], small[:, inner]), spread


def _wrapped(image: Floats, wrap: int) -> Floats:
    return np.pad(image, ((0, 0), (wrap, wrap)), mode="wrap") if wrap else image


def integral(image: Floats) -> Floats:
    """Sums over the rectangle from the origin to each corner, (rows + 1, columns + 1)."""
    integral = np.zeros((image.shape[0] + 1, image.shape[1] + 1))
    np.cumsum(np.cumsum(image, axis=0), axis=1, out=integral[1:, 1:])
    return integral


def _match(count: Floats, score: Floats, mean: float) -> tuple[Floats, Floats, Ints32, Floats, Floats]:
    """Of each position the box that stands out most: its statistic, noise and number.

    And the small box's statistic, and how much that varies in each row.
    """
    height, width = count.shape[0] - 1, count.shape[1] - 1
    best, inflation = np.zeros((height, width)), np.ones((height, width))
    shape, small = np.zeros((height, width), np.int32), np.zeros((height, width))
    small_spread = np.ones(height)
    statistic = np.empty((height, width))
    for number, (a, b) in enumerate(BOXES):
        if a > height or b > width:
            continue
        _box_statistic(count, score, a, b, mean, statistic)
        centre, spread = (one[:, None] for one in _row_cores(statistic))
        z = np.where(statistic == 0.0, 0.0, (statistic - centre) / spread)
        if number == _SMALL:
            small, small_spread = z, spread[:, 0]
        larger = np.abs(z) > np.abs(best)
        best, shape = np.where(larger, z, best), np.where(larger, np.int32(number), shape)
        inflation = np.where(larger, spread, inflation)
    return best, inflation, shape, small, small_spread


@njit(cache=True, nogil=True, error_model="numpy")
def _box_statistic(count: Floats, score: Floats, a: int, b: int, mean: float, statistic: Floats) -> None:
    """Sum of scores over root of the count in the box around each cell; 0 where most of it is empty."""
    height, width = statistic.shape
    least = max(0.3 * mean * a * b, 2.0)
    for i in range(height):
        top, bottom = max(i - a // 2, 0), min(i - a // 2 + a, height)
        for j in range(width):
            left, right = max(j - b // 2, 0), min(j - b // 2 + b, width)
            n = count[bottom, right] - count[top, right] - count[bottom, left] + count[top, left]
            if n < least:
                statistic[i, j] = 0.0
                continue
            s = score[bottom, right] - score[top, right] - score[bottom, left] + score[top, left]
            statistic[i, j] = s / np.sqrt(n)


@njit(cache=True, nogil=True, error_model="numpy")
def _core_sums(row: Floats, middle: float, reach: float) -> tuple[float, float, float]:
    """Number, sum and sum of squares of a row's values about ``middle``, as far as ``reach``."""
    n, total, square = 0.0, 0.0, 0.0
    for j in range(len(row)):
        x = row[j] - middle
        if row[j] != 0.0 and abs(x) <= reach:
            n, total, square = n + 1.0, total + x, square + x * x
    return n, total, square


@njit(cache=True, nogil=True, error_model="numpy")
def _row_cores(statistic: Floats) -> tuple[Floats, Floats]:
    """Centre and spread (at least 1) of each row's core, the spread drawn to that of all rows."""
    height = statistic.shape[0]
    centre, variance, number = np.zeros(height), np.ones(height), np.zeros(height)
    for i in range(height):
        for step in range(4):
            reach = 2.5 * max(np.sqrt(variance[i]), 1.0) if step else 4.0
            n, total, square = _core_sums(statistic[i], centre[i], reach)
            if n > 4.0:
                shift = total / n
                centre[i] += shift
                variance[i] = max(square / n - shift * shift, 0.0) / 0.83
            settled = step > 0 and n == number[i]
            number[i] = n
            if settled:
                break
    overall = (variance * number).sum() / max(number.sum(), 1.0)
    spread = np.sqrt((variance * number + overall * _PRIOR_POSITIONS) / (number + _PRIOR_POSITIONS))
    return centre, np.maximum(spread, 1.0)
