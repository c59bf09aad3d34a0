"""Where the residual field holds more than noise: matched boxes of many shapes, calibrated on the data.

Every box's mean is compared with the spread that boxes of its shape show over the whole field (robust, so that
burrs do not count). Correlated noise and waviness therefore raise the threshold of the shapes they resemble.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy import ndimage
from scipy.special import ndtri

from burrscan.arrays import Bools, Floats, Ints32
from burrscan.burrs.field import Field

_SHORT = (1, 2, 4)
_LONG = (3, 9, 27)
"""Sides of the boxes in cells; each pair both ways round."""
_POSITIONS = 4000
"""Positions from which the spread of a box shape is measured."""
_LEAST_VERTICES = 4
_GROW = 2.5
"""A burr's cells reach out to where a box of 3 × 3 cells is this many sigma high."""


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
        How much larger than independent noise would give the spread of that box shape is.

    """

    cells: Bools
    sign: int
    significance: float
    inflation: float


def boxes() -> list[tuple[int, int]]:
    """The (rows, columns) of every matched box."""
    sides = [(a, b) for a in _SHORT for b in _LONG if b > a]
    return [*sides, *((b, a) for a, b in sides), (2, 2), (4, 4)]


def threshold(cells: int, *, false_calls_per_wheel: float) -> float:
    """The box statistic that noise exceeds ``false_calls_per_wheel`` times on average.

    Independent tests are counted as three per box area, summed over shapes, both signs (Bonferroni).
    """
    tests = sum(3.0 * cells / (a * b) for a, b in boxes())
    return float(-ndtri(false_calls_per_wheel / (2.0 * tests)))


def regions(field: Field, *, false_calls_per_wheel: float) -> list[Region]:
    """Every anomaly of the field, most significant first. O(cells × shapes)."""
    limit = threshold(int((field.count > 0).sum()), false_calls_per_wheel=false_calls_per_wheel)
    best, inflation = strongest(field)
    found = []
    smooth = _statistic(field.count, field.score, (3, 3), field.closed)
    for sign in (1, -1):
        strong = sign * best > limit
        if strong.any():
            grown = strong | (sign * smooth > _GROW)
            found += _labelled(grown, strong, sign * best, inflation, sign, field)
    return sorted(found, key=lambda region: -region.significance)


def _labelled(
    grown: Bools, strong: Bools, statistic: Floats, inflation: Floats, sign: int, field: Field
) -> list[Region]:
    labels, count = ndimage.label(grown, structure=np.ones((3, 3)))
    if field.closed:
        _sew(labels)
    found = []
    for label in np.unique(labels[strong]):
        cells = labels == label
        if field.count[cells].sum() < _LEAST_VERTICES:
            continue
        peak = np.argmax(np.where(cells, statistic, -np.inf))
        found.append(Region(cells, sign, float(statistic.flat[peak]), float(inflation.flat[peak])))
    return found


def _sew(labels: Ints32) -> None:
    """Join the labels that meet across the seam of a closed field."""
    for row in range(len(labels)):
        left, right = labels[row, 0], labels[row, -1]
        if left and right and left != right:
            labels[labels == right] = left


def strongest(field: Field) -> tuple[Floats, Floats]:
    """Per cell the box statistic of largest size among the boxes centred there, and that shape's inflation."""
    best = np.zeros(field.count.shape)
    inflation = np.ones(field.count.shape)
    for shape in boxes():
        if shape[0] > field.count.shape[0] or shape[1] > field.count.shape[1]:
            continue
        statistic = _statistic(field.count, field.score, shape, field.closed)
        middle, spread = _spread(statistic)
        statistic = (statistic - middle) / max(spread, 1.0)
        better = np.abs(statistic) > np.abs(best)
        best[better] = statistic[better]
        inflation[better] = max(spread, 1.0)
    return best, inflation


def _spread(statistic: Floats) -> tuple[float, float]:
    """Median and robust standard deviation over the boxes that hold data."""
    known = statistic[statistic != 0.0]
    known = known[:: max(1, len(known) // _POSITIONS)]
    if len(known) < 20:
        return 0.0, 1.0
    low, middle, high = np.quantile(known, [0.16, 0.5, 0.84])
    return float(middle), float((high - low) / 2.0)


def _statistic(count: Floats, score: Floats, shape: tuple[int, int], closed: bool) -> Floats:
    """Sum of scores over root of the count, in the box around each cell; 0 where half of it is empty."""
    half = (shape[0] // 2, shape[1] // 2)
    mode = "wrap" if closed else "constant"
    pads = ((half[0], shape[0] - 1 - half[0]), (half[1], shape[1] - 1 - half[1]))
    sums = []
    for image in (count, score):
        rows = np.pad(image, (pads[0], (0, 0)))
        padded = np.pad(rows, ((0, 0), pads[1]), mode=mode)  # type: ignore[call-overload]
        sums.append(_box(padded, shape[0], shape[1]))
    total, value = sums
    least = max(0.5 * float(count[count > 0].mean()) * shape[0] * shape[1] * 0.5, 2.0)
    return np.where(total >= least, value / np.sqrt(np.maximum(total, 1.0)), 0.0)


@njit(cache=True, nogil=True)
def _box(padded: Floats, rows: int, columns: int) -> Floats:
    """Sums over every rows × columns box of an image, by running sums."""
    height, width = padded.shape[0] - rows + 1, padded.shape[1] - columns + 1
    column_sums = np.zeros(padded.shape[1])
    result = np.empty((height, width))
    for i in range(rows - 1):
        column_sums += padded[i]
    for i in range(height):
        column_sums += padded[i + rows - 1]
        total = 0.0
        for j in range(columns - 1):
            total += column_sums[j]
        for j in range(width):
            total += column_sums[j + columns - 1]
            result[i, j] = total
            total -= column_sums[j]
        column_sums -= padded[i]
    return result
