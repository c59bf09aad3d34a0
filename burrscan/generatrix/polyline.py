"""A curve in the (z, r) plane as a polyline of several pieces, and the nearest place on it.

The material lies to the right of the curve's direction: the outward normal is the tangent turned to the left.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from burrscan.arrays import Bools, Floats, Ints, Ints32, freeze
from burrscan.inspection import Generatrix


@dataclass(frozen=True)
class Polyline:
    """Nodes and segments.

    Parameters
    ----------
    nodes_mm
        (K, 2) points (z, r), piece after piece.
    starts
        (M,) the first node of each segment; it ends at the node after that.

    """

    nodes_mm: Floats
    starts: Ints

    def __post_init__(self) -> None:
        freeze(self, nodes_mm=self.nodes_mm, starts=self.starts)

    @property
    def steps_mm(self) -> Floats:
        """(M, 2) from each segment's start to its end."""
        steps: Floats = self.nodes_mm[self.starts + 1] - self.nodes_mm[self.starts]
        return steps

    @property
    def lengths_mm(self) -> Floats:
        """(M,) length of each segment."""
        lengths: Floats = np.hypot(*self.steps_mm.T)
        return lengths

    @property
    def along_mm(self) -> Floats:
        """(M,) arc length, over all pieces without the gaps, at which each segment starts."""
        return np.concatenate([[0.0], np.cumsum(self.lengths_mm)[:-1]])

    def apart_mm(self, most_mm: float) -> Floats:
        """(M,) :attr:`along_mm` with the gaps, each as long as it is or ``most_mm``.

        Neighbours in such an order are neighbours on the part, which pieces end to end need not be.
        """
        first, last = np.array(self.pieces).T
        apart = np.hypot(*(self.nodes_mm[first[1:]] - self.nodes_mm[last[:-1]]).T)
        before = np.concatenate([[0.0], np.cumsum(np.minimum(apart, most_mm))])
        piece = np.searchsorted(first, self.starts, side="right") - 1
        return np.asarray(self.along_mm + before[piece])

    @property
    def normals(self) -> Floats:
        """(M, 2) unit normals (z, r), outwards."""
        steps = self.steps_mm
        return np.stack([-steps[:, 1], steps[:, 0]], axis=1) / self.lengths_mm[:, None]

    @property
    def pieces(self) -> list[tuple[int, int]]:
        """First and last node of each piece."""
        ends = np.flatnonzero(np.diff(self.starts) > 1)
        first = self.starts[np.concatenate([[0], ends + 1])]
        last = self.starts[np.append(ends, len(self.starts) - 1)] + 1
        return list(zip(first.tolist(), last.tolist(), strict=True))

    def every(self, step_mm: float) -> tuple[Floats, Ints]:
        """(N, 2) places (z, r), so far apart along the curve, and (N,) their segments; gaps are left out."""
        ends = np.cumsum(self.lengths_mm)
        along = np.arange(0.5 * step_mm, ends[-1], step_mm)
        segment = np.minimum(np.searchsorted(ends, along), len(ends) - 1)
        return self.places_mm(segment, 1.0 - (ends[segment] - along) / self.lengths_mm[segment]), segment

    def places_mm(self, segment: Ints | Ints32, t: Floats) -> Floats:
        """(N, 2) places (z, r) on segments (N,), t (N,) of the way from start to end."""
        places: Floats = self.nodes_mm[self.starts[segment]] + t[:, None] * self.steps_mm[segment]
        return places


def is_closed(piece: Floats) -> bool:
    """Whether a (K, 2) piece ends where it began."""
    return np.array_equal(piece[0], piece[-1])


def revolved(meridian_zr: Floats, angles: Floats) -> Floats:
    """(S, N, 3) pairs (z, r) (S, 2), places or directions, turned about the axis by angles (N,), radians."""
    z, r = meridian_zr[:, :1], meridian_zr[:, 1:]
    x, y = r * np.cos(angles), r * np.sin(angles)
    return np.stack([x, y, np.broadcast_to(z, x.shape)], axis=-1)


def turned(meridian_zr: Floats, angle: Floats) -> Floats:
    """(N, 3) pairs (z, r) (N, 2), places or directions, each turned about the axis by its angle (N,), rad."""
    z, r = meridian_zr.T
    return np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)


def join(pieces: list[Floats]) -> Polyline:
    """One polyline of several (K, 2) pieces."""
    last = np.cumsum([len(piece) for piece in pieces])
    starts = np.setdiff1d(np.arange(last[-1]), last - 1)
    return Polyline(np.concatenate(pieces), starts)


def polyline_of(generatrix: Generatrix) -> Polyline:
    """The polyline of a generatrix, whose NaN pairs separate its pieces and get no node."""
    points = np.stack([generatrix.z_mm, generatrix.r_mm], axis=1)
    gap = ~np.isfinite(points).all(axis=1)
    pieces = [
        piece[np.isfinite(piece).all(axis=1)] for piece in np.split(points, np.flatnonzero(gap)) if len(piece)
    ]
    return join([piece for piece in pieces if len(piece) > 1])


@dataclass(frozen=True)
class Candidates:
    """For each occupied cell of a grid in the (z, r) plane, the segments that can be nearest to its points.

    Parameters
    ----------
    low_mm, side_mm
        Corner of the grid and side of a cell.
    index
        (rows, columns) number of each cell, -1 where no data lie.
    first, segments
        Cell i has ``segments[first[i]:first[i + 1]]``; none where the curve is beyond reach.

    """

    low_mm: Floats
    side_mm: float
    index: Ints32
    first: Ints
    segments: Ints32


_MOST_CELLS = 512
"""Along the longer side of the grid of candidate segments: bounds its memory; larger cells are exact, only
slower."""


def candidates(
    z: Floats, r: Floats, line: Polyline, *, side_mm: float, slack_mm: float, reach_mm: float
) -> Candidates:
    """Prepare the search for the nearest segment.

    Parameters
    ----------
    z, r
        (V,) the points that will ask.
    line
        The curve.
    side_mm
        Wanted cell side; larger where the reach would need more than 512 cells a side.
    slack_mm
        How far nodes may move before the lists must be made anew.
    reach_mm
        Cells further than this from the curve get no segments.

    Notes
    -----
    O(V + occupied cells × segments). Exact: a cell keeps every segment whose distance from its centre is
    within the nearest one's plus the cell's diagonal.

    """
    low = line.nodes_mm.min(axis=0) - reach_mm
    high = line.nodes_mm.max(axis=0) + reach_mm
    side = max(side_mm, float((high - low).max()) / _MOST_CELLS)
    size = np.ceil((high - low) / side).astype(np.int64)
    index, place = _occupied(z, r, low, size, side)
    centres = low + (place + 0.5) * side
    first, segments = _lists(centres, *_unpacked(line), side, slack_mm, reach_mm)
    return Candidates(low, side, index, first, segments)


@njit(cache=True, nogil=True, error_model="numpy")
def _occupied(z: Floats, r: Floats, low: Floats, size: Ints, side: float) -> tuple[Ints32, Ints]:
    index = np.full((size[0], size[1]), -1, np.int32)
    place = np.empty((min(size[0] * size[1], len(z)), 2), np.int64)
    count = 0
    for i in range(len(z)):
        u, v = (z[i] - low[0]) / side, (r[i] - low[1]) / side
        if 0.0 <= u < size[0] and 0.0 <= v < size[1] and index[int(u), int(v)] < 0:
            index[int(u), int(v)] = count
            place[count, 0], place[count, 1] = int(u), int(v)
            count += 1
    return index, place[:count]


@njit(cache=True, nogil=True, error_model="numpy")
def _append_near(square: Floats, most: float, segments: Ints32, count: int) -> int:
    """Write the numbers of values up to ``most`` behind the first ``count``; how many there are then."""
    for k in range(len(square)):
        if square[k] <= most:
            segments[count] = k
            count += 1
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def _lists(
    centres: Floats,
    a: Floats,
    b: Floats,
    dz: Floats,
    dr: Floats,
    inverse: Floats,
    side: float,
    slack: float,
    reach: float,
) -> tuple[Ints, Ints32]:
    first = np.zeros(len(centres) + 1, np.int64)
    segments = np.empty(8 * len(centres) + len(a), np.int32)
    square = np.empty(len(a))
    margin = 1.4143 * side + 2.0 * slack
    count = 0
    for i in range(len(centres)):
        least = np.inf
        for k in range(len(a)):
            x, y = centres[i, 0] - a[k], centres[i, 1] - b[k]
            t = min(max((x * dz[k] + y * dr[k]) * inverse[k], 0.0), 1.0)
            square[k] = (x - t * dz[k]) ** 2 + (y - t * dr[k]) ** 2
            least = min(least, square[k])
        least = np.sqrt(least)
        if least <= reach + side:
            if count + len(a) > len(segments):
                segments = np.concatenate((segments, np.empty(len(segments) + len(a), np.int32)))
            count = _append_near(square, (least + margin) ** 2, segments, count)
        first[i + 1] = count
    return first, segments[:count]


def _unpacked(line: Polyline) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Start (a, b), step (dz, dr) and inverse squared length of every segment."""
    (a, b), (dz, dr) = line.nodes_mm[line.starts].T.copy(), line.steps_mm.T.copy()
    return a, b, dz, dr, 1.0 / (dz * dz + dr * dr)


@dataclass(frozen=True)
class Foot:
    """The nearest place on the curve of each point.

    Parameters
    ----------
    segment
        (V,) its segment, -1 beyond reach or beyond an open end.
    t
        (V,) place along the segment, 0 to 1.
    distance_mm
        (V,) signed normal distance, outwards positive; NaN where the segment is -1.

    """

    segment: Ints32
    t: Floats
    distance_mm: Floats

    @property
    def valid(self) -> Bools:
        """(V,) True where there is a foot."""
        found: Bools = self.segment >= 0
        return found


def feet(z: Floats, r: Floats, line: Polyline, near: Candidates, *, overshoot_mm: float) -> Foot:
    """Nearest places; points that lie more than ``overshoot_mm`` beyond an open end have none. O(V)."""
    begins, ends = _open_ends(line)
    unpacked = _unpacked(line)
    root = np.sqrt(unpacked[-1])
    return Foot(
        *_feet(
            z,
            r,
            *unpacked,
            root,
            begins,
            ends,
            np.where(begins, -overshoot_mm * root, -np.inf),
            np.where(ends, 1.0 + overshoot_mm * root, np.inf),
            near.low_mm,
            near.side_mm,
            near.index,
            near.first,
            near.segments,
        )
    )


def at_open_end(line: Polyline, foot: Foot) -> Bools:
    """(V,) True where the nearest place on the curve is an open end of it, or lies beyond."""
    begins, ends = _open_ends(line)
    at = np.maximum(foot.segment, 0)
    held: Bools = foot.valid & ((begins[at] & (foot.t <= 0.0)) | (ends[at] & (foot.t >= 1.0)))
    return held


def _open_ends(line: Polyline) -> tuple[Bools, Bools]:
    """Segments that begin, and segments that end, where their piece has an open end."""
    begins, ends = np.zeros(len(line.starts), bool), np.zeros(len(line.starts), bool)
    first, last = np.array(line.pieces).T
    is_open = (line.nodes_mm[first] != line.nodes_mm[last]).any(axis=1)
    begins[np.searchsorted(line.starts, first)] = is_open
    ends[np.searchsorted(line.starts, last - 1)] = is_open
    return begins, ends


@njit(cache=True, nogil=True, error_model="numpy")
def _feet(
    z: Floats,
    r: Floats,
    a: Floats,
    b: Floats,
    dz: Floats,
    dr: Floats,
    inverse: Floats,
    root: Floats,
    begins: Bools,
    ends: Bools,
    earliest: Floats,
    latest: Floats,
    low: Floats,
    side: float,
    index: Ints32,
    first: Ints,
    segments: Ints32,
) -> tuple[Ints32, Floats, Floats]:
    segment, place, signed = np.empty(len(z), np.int32), np.empty(len(z)), np.empty(len(z))
    per, low_z, low_r = 1.0 / side, low[0], low[1]
    for i in range(len(z)):
        zi, ri = z[i], r[i]
        u, v = (zi - low_z) * per, (ri - low_r) * per
        inside = (u >= 0.0) & (u < index.shape[0]) & (v >= 0.0) & (v < index.shape[1])
        cell = index[np.uint32(u), np.uint32(v)] if inside else np.int32(-1)
        best, least, facing, t = np.int32(-1), np.inf, 0.0, 0.0
        if cell >= 0:
            for j in range(np.uint64(first[np.uint32(cell)]), np.uint64(first[np.uint32(cell) + 1])):
                k = np.uint32(segments[j])
                x, y = zi - a[k], ri - b[k]
                along = (x * dz[k] + y * dr[k]) * inverse[k]
                held = min(max(along, 0.0), 1.0)
                square = (x - held * dz[k]) ** 2 + (y - held * dr[k]) ** 2
                # At a corner two segments are equally near: the one that sees the point more squarely gives
                # the sign. Choices instead of branches, which no processor could foretell.
                depth = (y * dz[k] - x * dr[k]) ** 2 * inverse[k]
                alike, nearer = square <= least * (1.0 + 1e-12), square < least * (1.0 - 1e-12)
                chosen = nearer | (alike & (depth > facing))
                best, t = (segments[j] if chosen else best), (along if chosen else t)
                least, facing = (square if chosen else least), (depth if chosen else facing)
        k = np.uint32(max(int(best), 0))
        found = (best >= 0) & (t >= earliest[k]) & (t <= latest[k])
        beyond = (begins[k] & (t < 0.0)) | (ends[k] & (t > 1.0))
        depth = ((ri - b[k]) * dz[k] - (zi - a[k]) * dr[k]) * root[k]
        distance = depth if beyond else np.copysign(np.sqrt(least), depth)
        segment[i] = best if found else -1
        place[i] = min(max(t, 0.0), 1.0) if found else 0.0
        signed[i] = distance if found else np.nan
    return segment, place, signed
