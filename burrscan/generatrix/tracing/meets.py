"""Ends of two pieces that run towards one corner: what stands on an edge may part the cells beside it."""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np

from burrscan.arrays import Floats
from burrscan.generatrix.polyline import is_closed
from burrscan.generatrix.tracing.creases import LEAST_TURN, SIDE, STRAIGHT, crossing, side_lines
from burrscan.generatrix.tracing.trace import SHARPEST

_NODES = SIDE + 1
"""Of an end that tell where it runs to: the last, which may have followed a burr, is left out."""
_REACHES = 0.5
"""Node spacings by which the longer of two ends falls short of a corner at most, and its last node is
off its line: where both fall short by more, or one has turned, what is between them may be a rounding."""


class _End(NamedTuple):
    """A piece's nodes towards one of its ends, and the line that it runs out along."""

    piece: int
    nodes: Floats
    centre: Floats
    tangent: Floats


class _Corner(NamedTuple):
    """Two ends, where their lines meet, how far from both at most, and from the nearer along its line, mm."""

    one: _End
    other: _End
    at: Floats
    far_mm: float
    short_mm: float


def met(pieces: list[Floats], *, spacing_mm: float, reach_mm: float) -> list[Floats]:
    """The pieces, those made one whose straight ends meet within reach, the nearest first. O(pieces³).

    Along an edge with burrs the cells run on into these. A walk from the one side follows them and leaves
    none for a walk from the other.

    Parameters
    ----------
    pieces
        (K, 2) points (z, r) each; a closed one ends where it began.
    spacing_mm
        Between nodes.
    reach_mm
        From either end to the corner at most, and from either beyond it.

    """
    pieces = list(pieces)
    while True:
        ends = [end for i in range(len(pieces)) for end in _ends(pieces[i], i, spacing_mm)]
        corners = [_corner(one, other) for one, other in combinations(ends, 2)]
        least = _REACHES * spacing_mm
        near = [one for one in corners if one is not None and one.far_mm < reach_mm and one.short_mm < least]
        if not near:
            return pieces
        best = min(near, key=lambda corner: corner.far_mm)
        joined = _joined(best)
        gone = {best.one.piece, best.other.piece}
        pieces = [piece for i, piece in enumerate(pieces) if i not in gone] + [joined]


def _ends(piece: Floats, number: int, spacing: float) -> list[_End]:
    """Both ends of an open piece, as far as they are straight: one whose last node has turned is round."""
    if len(piece) < 2 * _NODES or is_closed(piece):
        return []
    found = []
    for nodes in (piece, piece[::-1]):
        centre, tangent, bend = side_lines(nodes, np.arange(len(nodes) - _NODES, len(nodes) - 1)[None])
        last = nodes[-1] - centre[0]
        off = abs(float(last[0] * tangent[0, 1] - last[1] * tangent[0, 0]))
        if bend[0] < STRAIGHT * spacing and off < _REACHES * spacing:
            found.append(_End(number, nodes, centre[0], tangent[0]))
    return found


def _corner(one: _End, other: _End) -> _Corner | None:
    """Where two ends meet, if they turn as the sides of a corner do."""
    if one.piece == other.piece:
        return None
    cosine = -float(one.tangent @ other.tangent)
    if not SHARPEST < cosine < np.cos(LEAST_TURN):
        return None
    at = crossing(one.centre[None], one.tangent[None], other.centre[None], other.tangent[None])[0]
    far = max(float(np.linalg.norm(at - end.nodes[-1])) for end in (one, other))
    short = min(float((at - end.nodes[-1]) @ end.tangent) for end in (one, other))
    return _Corner(one, other, at, far, short)


def _joined(corner: _Corner) -> Floats:
    """One piece of two, by way of their corner, without the nodes that ran beyond it."""
    one, other = (_up_to(corner.at, end) for end in (corner.one, corner.other))
    return np.concatenate([one, corner.at[None], other[::-1]])


def _up_to(at: Floats, end: _End) -> Floats:
    """A piece's nodes without its last ones that lie beyond a place; what lies there further back stays."""
    before = np.flatnonzero((end.nodes - at) @ end.tangent < 0.0)
    return end.nodes[: int(before.max(initial=-1)) + 1]
