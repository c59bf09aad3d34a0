"""Sharp creases: where two straight sides meet, the node goes to their intersection."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats, Ints

_SIDE = 3
"""Nodes of each side that its line is fitted to; the node next to the crease is left out."""
_LEAST_TURN = np.radians(20.0)
"""Rad. Two lines that meet at less than that cross so flatly that noise moves their crossing along them."""
_STRAIGHT = 0.08
"""Largest deviation of a side's nodes from their line, in node spacings: a rounding is no crease."""


def sharpened(piece: Floats) -> Floats:
    """A (K, 2) piece with its creases put where the sides' lines meet. O(K).

    Within about three node spacings of a crease the least-squares nodes round it off; the sides further away
    know better where it is.
    """
    corners = _corners(piece)
    if not corners:
        return piece
    points = piece.copy()
    drop = np.zeros(len(piece), dtype=np.bool_)
    for k, corner in corners.items():
        drop[k - 1 : k + 2] = [True, False, True]
        points[k] = corner
    return points[~drop]


def _corners(piece: Floats) -> dict[int, Floats]:
    """Node number to intersection, strongest turns first, none within reach of another."""
    reach = _SIDE + 1
    if len(piece) < 2 * reach + 1:
        return {}
    spacing = float(np.median(np.linalg.norm(np.diff(piece, axis=0), axis=1)))
    middle = np.arange(reach, len(piece) - reach)
    before, after = middle[:, None] + np.arange(-reach, -1), middle[:, None] + np.arange(2, reach + 1)
    centre_a, tangent_a, bend_a = _lines(piece, before)
    centre_b, tangent_b, bend_b = _lines(piece, after)
    cross = tangent_a[:, 0] * tangent_b[:, 1] - tangent_a[:, 1] * tangent_b[:, 0]
    turn = np.abs(np.arctan2(cross, (tangent_a * tangent_b).sum(axis=1)))
    gap = centre_b - centre_a
    with np.errstate(divide="ignore", invalid="ignore"):
        reach_a = (gap[:, 0] * tangent_b[:, 1] - gap[:, 1] * tangent_b[:, 0]) / cross
        meeting = centre_a + reach_a[:, None] * tangent_a
    offset = np.linalg.norm(meeting - piece[middle], axis=1)
    good = (
        (turn > _LEAST_TURN) & (np.maximum(bend_a, bend_b) < _STRAIGHT * spacing) & (offset < 1.2 * spacing)
    )
    return _strongest(middle[good], turn[good] - 0.5 * offset[good] / spacing, meeting[good])


def _strongest(nodes: Ints, strength: Floats, meeting: Floats) -> dict[int, Floats]:
    corners: dict[int, Floats] = {}
    for i in np.argsort(-strength, kind="stable"):
        if all(abs(int(nodes[i]) - k) > 2 for k in corners):
            corners[int(nodes[i])] = meeting[i]
    return corners


def _lines(piece: Floats, windows: Ints) -> tuple[Floats, Floats, Floats]:
    """Centre, direction (along the piece) and largest deviation of the lines through windows of nodes."""
    points = piece[windows]
    centre = points.mean(axis=1)
    offset = points - centre[:, None]
    zz, rr = (offset[..., 0] ** 2).sum(axis=1), (offset[..., 1] ** 2).sum(axis=1)
    turn = 0.5 * np.arctan2(2.0 * offset.prod(axis=2).sum(axis=1), zz - rr)
    tangent = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    sense = np.sign(((points[:, -1] - points[:, 0]) * tangent).sum(axis=1))
    tangent *= np.where(sense == 0.0, 1.0, sense)[:, None]
    bend = np.abs(offset[..., 0] * tangent[:, None, 1] - offset[..., 1] * tangent[:, None, 0]).max(axis=1)
    return centre, tangent, bend
