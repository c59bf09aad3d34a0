"""Where a piece of the curve ends: as far as the data reach over a good share of their arc."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Bools, Floats
from burrscan.generatrix.polyline import Foot, Polyline, is_closed, join
from burrscan.generatrix.tracing.cells import ARC_BINS, arc_bin

_LEAST = 0.35
"""Share of its neighbours' angular coverage that the end must have."""
_NEAR = 10
"""Segments next to an end inwards that say over which angles there is data."""


def extended(piece: Floats, *, by_mm: float) -> Floats:
    """Lengthen both open ends of a (K, 2) piece along its tangents."""
    if is_closed(piece):
        return piece
    ahead, behind = piece[-1] - piece[-3], piece[0] - piece[2]
    ahead, behind = (by_mm * v / np.linalg.norm(v) for v in (ahead, behind))
    count = max(1, round(by_mm / float(np.linalg.norm(piece[1] - piece[0]))))
    steps = np.arange(1, count + 1)[:, None] / count
    return np.concatenate([(piece[0] + steps * behind)[::-1], piece, piece[-1] + steps * ahead])


def trimmed(line: Polyline, foot: Foot, seen: Bools) -> list[Floats]:
    """The pieces of a line, cut back to segments that cells ``seen`` (cells, bins) cover. O(cells + K)."""
    segment, t = foot.segment[foot.valid], foot.t[foot.valid]
    covered = np.zeros((len(line.starts), seen.shape[1]), np.bool_)
    np.logical_or.at(covered, segment, seen[foot.valid])
    coverage = covered.sum(axis=1).astype(np.float64)
    far = np.tile([0.9, 0.1], (len(line.starts), 1))  # least and largest place, at most 0.9 of it cut off
    np.minimum.at(far[:, 0], segment, t)
    np.maximum.at(far[:, 1], segment, t)
    pieces = []
    for segments in np.split(np.arange(len(line.starts)), np.flatnonzero(np.diff(line.starts) > 1) + 1):
        first, last = _covered(coverage[segments])
        if last < first:
            continue
        nodes = line.nodes_mm[line.starts[segments[first]] : line.starts[segments[last]] + 2].copy()
        if not is_closed(nodes):
            nodes[0] += far[segments[first], 0] * (nodes[1] - nodes[0])
            nodes[-1] += (1.0 - far[segments[last], 1]) * (nodes[-2] - nodes[-1])
        pieces.append(nodes)
    return pieces


def _covered(coverage: Floats) -> tuple[int, int]:
    """First and last segment that have their share of the coverage of the ten next to them inwards."""
    first, last = 0, len(coverage) - 1
    while first <= last and coverage[first] <= _LEAST * coverage[first : first + _NEAR].max():
        first += 1
    while last >= first and coverage[last] <= _LEAST * coverage[max(last - _NEAR + 1, 0) : last + 1].max():
        last -= 1
    return first, last


def cut_back(line: Polyline, foot: Foot, angle: Floats, arc: tuple[float, float]) -> Polyline:
    """Open ends of the pieces drawn back to where a good share of the arc has data. O(V + K).

    A curve that runs on beyond its data runs straight, past whatever rounding the part ends with.

    Parameters
    ----------
    line, foot
        The fitted curve and the points' nearest places on it.
    angle
        (V,) the points' angles, radians.
    arc
        (start, extent) of the angles with data.

    """
    number = {int(node): k for k, node in enumerate(line.starts)}
    asked = np.zeros(len(line.starts), np.bool_)
    for first, last in line.pieces:
        begin, end = number[first], number[last - 1]
        asked[begin : begin + _NEAR] = asked[max(end - _NEAR + 1, begin) : end + 1] = True
    told = foot.valid & asked[foot.segment]
    at = foot.segment[told], arc_bin(angle[told], arc)
    low, high = (np.full((len(line.starts), ARC_BINS), far) for far in (np.inf, -np.inf))
    np.minimum.at(low, at, foot.t[told])
    np.maximum.at(high, at, foot.t[told])
    pieces = []
    for first, last in line.pieces:
        nodes = line.nodes_mm[first : last + 1].copy()
        if not is_closed(nodes):
            begin, end = number[first], number[last - 1]
            missing = _short(low[begin : begin + _NEAR])
            nodes[0] += min(missing, 0.9) * (nodes[1] - nodes[0])
            missing = _short(1.0 - high[max(end - _NEAR + 1, begin) : end + 1][::-1])
            nodes[-1] += min(missing, 0.9) * (nodes[-2] - nodes[-1])
        pieces.append(nodes)
    return join(pieces)


def _short(places: Floats) -> float:
    """By how much of its last segment the data fall short of the end, but for a share of the bins near it.

    ``places`` are (segments, bins) from the end inwards, infinite where a bin has no data: one with data in
    the others only falls short by all of it.
    """
    near = np.isfinite(places).any(axis=0)
    return float(np.quantile(np.minimum(places[0, near], 1.0), _LEAST)) if near.any() else 0.0
