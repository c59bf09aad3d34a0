"""Stretches of an edge on which both light and depth are other than beside it, and change at both ends.

Light along a clean edge changes, too: with the lobe, with what the faces mirror, in glints. But it changes
slowly, and its depths are the edge's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from burrscan.arrays import Bools, Floats, Ints
from burrscan.burrs.along_edges.strips import REACH, Strip
from burrscan.robust import SIGMA_PER_MEDIAN

_ROWS = (1, 2, 3)
"""Pixels across its edge over which a burr changes light alike; four tell nothing else."""
_BESIDE = 5
"""Pixels to either side of the edge within which they lie."""
_RAMPS = (4, 8)
"""Pixels to either side of an end whose means are compared; torn burrs end slowly."""
_GAP = 1
"""Pixels between those and the end, which lies within one."""
_STEP = 13.5
"""Robust deviations, of what such means differ by along this edge, by which light changes at both ends. With
this and 9 below 77 of 204 rendered burrs on edges are seen, and on none of 608 scans what is none; with 12
and 8 94 and three, with 12 and 9 85 and three, with 10 and 9 91 and seven."""
_NO_NOISE = 0.01
"""Least such deviation: models of light are no better."""
_ALIKE = 0.3
"""Least ratio of what lies between the ends to the change of light at them."""
_BETWEEN = 0.8
"""Share of what lies between that is so."""
_FEWEST = 10
"""Pixels that a burr is long at least: glints of polished edges are shorter."""
_LONGEST = np.radians(60.0)
"""Around the axis, that it is at most: over more the lobe changes light as a burr's ends do. Of two calls
that were none, on rims of a polished and of a turned wheel, both were longer (83 and 119 degrees)."""
_MARGIN = 20
"""Pixels at either end of a strip, more than a ramp, of which nothing is said: it turns out of sight."""
_OTHER_ROWS = 0.4
"""Share of the change of light that the pixels next to it may have: what goes on across the edge is a mirror
image, a shadow, a stain or a burr along the axis."""
_ODD = 9.0
"""Standard deviations by which depths are odder within than beside."""
_ODDER = 0.2
"""Share of the depths that are odd within beyond that beside; of a row of a burr, too."""
_FEWEST_DEPTHS = 8
"""Pixels within, and beside, whose depths tell that."""
_BESIDE_PX = 20.0
"""Along the edge, or as far as the stretch is long, depths beside it are looked at; two pixels from it."""
_STRIP_ROWS = 2 * REACH
"""Rows of pixels of a strip."""
_WILD = 2.0
"""Of the light of the faces: more counts as so much."""
_CENTRED = np.radians(1.5)
"""A stretch whose middle is so near to where a rounding mirrors the projector is its glint, or what is dark
beside it. Of twelve on polished edges the middles were off by 1.0 degrees at most."""


class Box(NamedTuple):
    """A stretch of an edge.

    Pixels of its strip (P,) True on it, how clear it is, in deviations, and over how many rows of pixels
    across the edge depths are odd there.
    """

    strip: Strip
    on: Bools
    clear: float
    rows: int


@dataclass(frozen=True)
class _Sums:
    """Sums over the first pixels along the edge: of what is unexplained there, and of how many there are.

    Of each row of pixels, or of several together.
    """

    total: Floats
    count: Floats

    def together(self, first: int, stop: int) -> _Sums:
        """Of some rows, as one."""
        return _Sums(self.total[first:stop].sum(axis=0), self.count[first:stop].sum(axis=0))

    def mean(self, start: Ints | int, stop: Ints | int) -> Floats:
        """Of the pixels from one place along the edge to another; 0 where there are none."""
        count = np.maximum(self.count[stop] - self.count[start], 1.0)
        mean: Floats = (self.total[stop] - self.total[start]) / count
        return mean


def boxes(strip: Strip, light: Floats, odd: Bools) -> list[Box]:
    """The stretches of a strip whose light (P,), unexplained, and depths (P,), odd or not, are no edge's.

    O(P + length × shapes). The clearest first; they may overlap.
    """
    row = np.clip(np.floor(strip.off_px + REACH).astype(np.int64), 0, _STRIP_ROWS - 1)
    sums = _summed(strip, row, light)
    found = []
    for high, first, ramp in _shapes():
        for start, stop, clear in _between_steps(sums, first, high, ramp):
            rows = (strip.off_px >= first - REACH - 0.5) & (strip.off_px < first + high - REACH + 0.5)
            more, sigma = _odder(strip, odd, rows, start, stop)
            on = (row >= first) & (row < first + high) & (strip.arc_px >= start) & (strip.arc_px < stop)
            if more > max(_ODDER, _ODD * sigma) and _is_no_lobe(strip, on) and _is_no_glint(strip, on):
                each = [_odder(strip, odd, row == number, start, stop)[0] for number in range(_STRIP_ROWS)]
                across = sum(one > _ODDER for one in each)
                found.append(Box(strip, on, min(clear / _STEP, more / sigma / _ODD) * _ODD, across))
    return sorted(found, key=lambda box: -box.clear)


def _shapes() -> list[tuple[int, int, int]]:
    """Rows that a burr may take, the first of them, and the ramps at its ends."""
    return [
        (high, first, ramp)
        for high in _ROWS
        for first in range(REACH - _BESIDE, REACH + _BESIDE - high + 1)
        for ramp in _RAMPS
    ]


def _summed(strip: Strip, row: Ints, light: Floats) -> _Sums:
    """Of every row of pixels beside the edge."""
    known = np.isfinite(light)
    shape = _STRIP_ROWS, int(strip.arc_px.max()) + 2
    flat = (row * shape[1] + strip.arc_px.astype(np.int64))[known]
    cut = np.clip(light[known], -_WILD, _WILD)
    total, count = (
        np.pad(np.cumsum(np.asarray(each, np.float64).reshape(shape), axis=1), ((0, 0), (1, 0)))
        for each in (np.bincount(flat, weight, shape[0] * shape[1]) for weight in (cut, np.ones(len(cut))))
    )
    return _Sums(total, count)


def _between_steps(sums: _Sums, first: int, high: int, ramp: int) -> list[tuple[int, int, float]]:
    """Where light steps one way and then back: start and end along the edge, and the smaller step."""
    band = sums.together(first, first + high)
    next_to = [
        sums.together(start, stop)
        for start, stop in (
            (max(first - 3, 0), first - 1),
            (first + high + 1, min(first + high + 3, _STRIP_ROWS)),
        )
        if stop > start
    ]
    length = len(band.total) - 1
    at = np.arange(_MARGIN, length - _MARGIN)
    if len(at) < 6 * ramp:
        return []
    after, before = (at + _GAP, at + _GAP + ramp), (at - _GAP - ramp, at - _GAP)
    full = np.all([band.count[b] - band.count[a] > 0.5 * high * ramp for a, b in (after, before)], axis=0)
    if np.count_nonzero(full) < 5 * ramp:
        return []
    change = np.where(full, band.mean(*after) - band.mean(*before), 0.0)
    size = change / max(SIGMA_PER_MEDIAN * float(np.median(np.abs(change[full]))), _NO_NOISE)
    ends = [
        place
        for place in np.flatnonzero(np.abs(size) > _STEP)
        if np.abs(size[place]) >= np.abs(size[max(place - ramp, 0) : place + ramp + 1]).max()
    ]
    found = []
    for number, one in enumerate(ends):
        for other in ends[number + 1 :]:
            start, stop = int(at[one]), int(at[other])
            if stop - start < _FEWEST:
                continue
            steps = float(change[one]), float(change[other])
            if _is_a_box(band, next_to, start, stop, ramp, steps):
                found.append((start, stop, float(min(abs(size[one]), abs(size[other])))))
    return found


def _is_a_box(
    band: _Sums, next_to: list[_Sums], start: int, stop: int, ramp: int, steps: tuple[float, float]
) -> bool:
    """Whether what lies between two steps is as they say, and what is next to it, across the edge, is not."""
    contrast = 0.5 * (steps[0] - steps[1])
    outside = band.mean(start - _GAP - ramp, start - _GAP), band.mean(stop + _GAP, stop + _GAP + ramp)
    columns = np.arange(start + 1, stop - 1)
    columns = columns[band.count[columns + 1] > band.count[columns]]
    inside = band.mean(columns, columns + 1) - np.interp(columns, [start, stop], outside)
    if not len(columns) or np.mean(inside * np.sign(contrast) > _ALIKE * abs(contrast)) < _BETWEEN:
        return False
    for rows in next_to:
        if rows.count[stop] - rows.count[start] < _ALIKE * (stop - start):
            continue
        beside = 0.5 * (
            rows.mean(start - _GAP - ramp, start - _GAP) + rows.mean(stop + _GAP, stop + _GAP + ramp)
        )
        if (rows.mean(start + _GAP, stop - _GAP) - beside) / contrast > _OTHER_ROWS:
            return False
    return True


def _odder(strip: Strip, odd: Bools, rows: Bools, start: int, stop: int) -> tuple[float, float]:
    """By which share more depths are odd in a stretch than beside it, and its standard deviation."""
    arc = strip.arc_px
    reach = max(float(stop - start), _BESIDE_PX)
    within = rows & (arc >= start) & (arc < stop)
    beside = rows & (arc >= start - reach - 2.0) & (arc < stop + reach + 2.0)
    beside &= (arc < start - 2.0) | (arc >= stop + 2.0)
    counts = int(np.count_nonzero(within)), int(np.count_nonzero(beside))
    if min(counts) < _FEWEST_DEPTHS:
        return 0.0, 1.0
    numbers = int(np.count_nonzero(odd[within])), int(np.count_nonzero(odd[beside]))
    share = (sum(numbers) + 1.0) / (sum(counts) + 2.0)
    sigma = float(np.sqrt(share * (1.0 - share) * (1.0 / counts[0] + 1.0 / counts[1])))
    return numbers[0] / counts[0] - numbers[1] / counts[1], sigma


def _is_no_glint(strip: Strip, on: Bools) -> bool:
    """Whether a stretch is not the glint of a rounding, nor what is dark beside it."""
    low, high = float(strip.from_mirror[on].min()), float(strip.from_mirror[on].max())
    return bool(abs(low + high) > 2.0 * _CENTRED)


def _is_no_lobe(strip: Strip, on: Bools) -> bool:
    """Whether light changes at both ends of a stretch within so few degrees that no lobe does it."""
    return bool(np.ptp(strip.angle[on]) <= _LONGEST)
