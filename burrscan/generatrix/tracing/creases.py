"""Sharp creases: where two straight sides meet, the node goes to their intersection."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from burrscan.arrays import Floats, Ints
from burrscan.generatrix.polyline import Foot, Polyline, join
from burrscan.generatrix.profile import Profile
from burrscan.generatrix.tracing.cells import ARC_BINS, Scale

SIDE = 3
"""Nodes of each side that its line is fitted to; the node next to the crease is left out."""
LEAST_TURN = np.radians(20.0)
"""Rad. Two lines that meet at less than that cross so flatly that noise moves their crossing along them."""
STRAIGHT = 0.2
"""Largest deviation of a side's nodes from their line, in node spacings: more tells of no crossing."""
_FARTHEST = 1.2
"""Of a crease from the node that stands for it, in node spacings: farther away another node would."""
_CLEARLY = 3.0
"""Standard deviations of a vertex that the data beside a crease are off to speak against it."""
Fitted = tuple[Polyline, Foot]
"""A line and the data's nearest places on it."""


def creases(line: Polyline) -> dict[int, Floats]:
    """Nodes that two straight sides may meet at, and where they do. O(K)."""
    found: dict[int, Floats] = {}
    for first, last in line.pieces:
        found |= {first + k: at for k, at in _corners(line.nodes_mm[first : last + 1]).items()}
    return found


def sharpened(line: Polyline, creases: Mapping[int, Floats]) -> tuple[Polyline, Ints]:
    """The line with its creases put where the sides meet, without the nodes beside them; their numbers. O(K).

    Within about three node spacings of a crease the least-squares nodes round it off; the sides further away
    know better where it is.
    """
    nodes = line.nodes_mm.copy()
    kept = np.ones(len(nodes), dtype=np.bool_)
    for k, at in creases.items():
        nodes[k] = at
        kept[[k - 1, k + 1]] = False
    sharp = join([nodes[first : last + 1][kept[first : last + 1]] for first, last in line.pieces])
    return sharp, np.cumsum(kept)[list(creases)] - 1


def moved(creases: Mapping[int, Floats], fitted: Polyline, nodes: Ints) -> dict[int, Floats]:
    """The creases where the sides of a line meet that was fitted with them: no nodes beside them lean."""
    spacing = float(np.median(fitted.lengths_mm))
    beside = np.arange(1, SIDE + 1)
    reach = beside[-1]
    places = dict(creases)
    for k, node in zip(creases, nodes.tolist(), strict=True):
        if not reach <= node < len(fitted.nodes_mm) - reach:
            continue
        windows = node + np.stack([-beside[::-1], beside])
        place, tangent, bend = side_lines(fitted.nodes_mm, windows)
        meeting = crossing(place[:1], tangent[:1], place[1:], tangent[1:])[0]
        if bend.max() < STRAIGHT * spacing and np.linalg.norm(meeting - creases[k]) < _FARTHEST * spacing:
            places[k] = meeting
    return places


def borne_out(
    data: Profile, scale: Scale, *, rounded: Fitted, sharp: Sequence[tuple[Mapping[int, Floats], Fitted]]
) -> dict[int, Floats]:
    """The creases that the data beside them agree with: better than with a rounding, or well enough.

    The sides say where a crease would be, not whether there is one: a rounding has straight sides, too. Where
    rows of data lie as far apart as nodes, nodes go through each of them, and that proves nothing; so a
    crease that the data are off from by less than their noise explains stays. O(V log V).

    Parameters
    ----------
    data, scale
        The data, their noise and their arc.
    rounded
        A line and the data's nearest places on it, fitted without creases.
    sharp
        The same with all of them, in several places (z, r) by node: the best of each counts.

    """
    spacing = float(np.median(rounded[0].lengths_mm))
    turn = (data.angle - scale.arc[0]) % (2.0 * np.pi) / scale.arc[1] * ARC_BINS
    by_z = np.argsort(data.z_mm)
    kept = {}
    for k, at in sharp[0][0].items():
        ends = np.searchsorted(data.z_mm, [at[0] - SIDE * spacing, at[0] + SIDE * spacing], sorter=by_z)
        band = np.sort(by_z[slice(*ends)])
        near = band[np.hypot(data.z_mm[band] - at[0], data.r_mm[band] - at[1]) < SIDE * spacing]
        off, place = min(
            ((_off_mm(*fitted, near, turn, spacing), places[k]) for places, fitted in sharp),
            key=lambda one: one[0],
        )
        if off <= max(_off_mm(*rounded, near, turn, spacing), _CLEARLY * scale.noise_mm):
            kept[k] = place
    return kept


def _off_mm(line: Polyline, foot: Foot, near: Ints, turn: Floats, spacing: float) -> float:
    """Largest distance of the data in half a node spacing, in the median over the arc.

    A burr is on less than half of the arc, so no median sees it where the surface is in sight beside it.
    Where the data are on less than half of the arc that others are on, they are the burr's alone.
    """
    chosen = near[foot.valid[near]]
    if not len(chosen):
        return 0.0
    segment = foot.segment[chosen]
    along = line.along_mm[segment] + foot.t[chosen] * line.lengths_mm[segment]
    order = np.argsort(along, kind="stable")
    ends = np.flatnonzero(np.diff((along[order] // (0.5 * spacing)).astype(np.int64))) + 1
    means = [
        _means(foot.distance_mm[part], turn[part].astype(np.int64)) for part in np.split(chosen[order], ends)
    ]
    most = max(map(len, means))
    return max(abs(float(np.median(each))) for each in means if 2 * len(each) >= most)


def _means(values: Floats, group: Ints) -> Floats:
    """Means of the values of each group."""
    _, number, count = np.unique(group, return_inverse=True, return_counts=True)
    return np.asarray(np.bincount(number, values) / count)


def _corners(piece: Floats) -> dict[int, Floats]:
    """Node number to intersection, strongest turns first, none within reach of another."""
    reach = SIDE + 1
    if len(piece) < 2 * reach + 1:
        return {}
    spacing = float(np.median(np.linalg.norm(np.diff(piece, axis=0), axis=1)))
    middle = np.arange(reach, len(piece) - reach)
    before, after = middle[:, None] + np.arange(-reach, -1), middle[:, None] + np.arange(2, reach + 1)
    centre_a, tangent_a, bend_a = side_lines(piece, before)
    centre_b, tangent_b, bend_b = side_lines(piece, after)
    cross = tangent_a[:, 0] * tangent_b[:, 1] - tangent_a[:, 1] * tangent_b[:, 0]
    turn = np.abs(np.arctan2(cross, (tangent_a * tangent_b).sum(axis=1)))
    meeting = crossing(centre_a, tangent_a, centre_b, tangent_b)
    offset = np.linalg.norm(meeting - piece[middle], axis=1)
    good = (
        (turn > LEAST_TURN)
        & (np.maximum(bend_a, bend_b) < STRAIGHT * spacing)
        & (offset < _FARTHEST * spacing)
    )
    return _strongest(middle[good], turn[good] - 0.5 * offset[good] / spacing, meeting[good])


def crossing(place_a: Floats, tangent_a: Floats, place_b: Floats, tangent_b: Floats) -> Floats:
    """(N, 2) where pairs of lines through places meet, infinite where they do not."""
    gap = place_b - place_a
    with np.errstate(divide="ignore", invalid="ignore"):
        cross = tangent_a[:, 0] * tangent_b[:, 1] - tangent_a[:, 1] * tangent_b[:, 0]
        reach = (gap[:, 0] * tangent_b[:, 1] - gap[:, 1] * tangent_b[:, 0]) / cross
        return np.asarray(place_a + reach[:, None] * tangent_a)


def _strongest(nodes: Ints, strength: Floats, meeting: Floats) -> dict[int, Floats]:
    corners: dict[int, Floats] = {}
    for i in np.argsort(-strength, kind="stable"):
        if all(abs(int(nodes[i]) - k) > 2 for k in corners):
            corners[int(nodes[i])] = meeting[i]
    return corners


def side_lines(piece: Floats, windows: Ints) -> tuple[Floats, Floats, Floats]:
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
