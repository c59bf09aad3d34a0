"""Which side of the curve is air: a vote of the faces."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats, Ints32
from burrscan.generatrix.polyline import Polyline, candidates, feet, join
from burrscan.generatrix.tracing.cells import Looks
from burrscan.pose import placed

_FACES = 5_000
"""That vote, evenly thinned: the side of each piece is one of two, and some of them near it decide."""
_CLEAR = 0.2
"""A vote below this share of the area cast is no vote: the faces are not wound consistently."""


def oriented(
    pieces: list[Floats], vertices_mm: Floats, faces: Ints32, transform: Floats, *, side_mm: float
) -> list[Floats]:
    """Turn pieces round so that the outward normal is on the left of each.

    Parameters
    ----------
    pieces
        (K, 2) points (z, r) each.
    vertices_mm, faces
        The mesh; outwards is where its faces look (counter-clockwise seen from outside).
    transform
        ``T_part_mesh``.
    side_mm
        Faces further than two of these from the curve do not vote.

    Notes
    -----
    O(V + T). Without a clear vote (a cloud, or faces wound at random) a piece looks away from the axis, and a
    flat one away from the middle of the data along the axis.

    """
    line = join(pieces)
    vote = _vote(line, vertices_mm, faces, transform, side_mm)
    number = np.cumsum(np.diff(line.starts, prepend=line.starts[0] - 1) > 1)
    turned = []
    for i, piece in enumerate(pieces):
        mine = number == i
        cast, total = vote[0][mine].sum(), vote[1][mine].sum()
        clear = abs(cast) > _CLEAR * total
        turned.append(piece if (cast if clear else _away(line, mine)) >= 0.0 else piece[::-1])
    return turned


def _away(line: Polyline, mine: Floats) -> float:
    """Positive where the left side of a piece looks away from the axis, or for flat ones from the middle."""
    normal, length = line.normals[mine], line.lengths_mm[mine]
    outward = float((normal[:, 1] * length).sum())
    if abs(outward) > 0.1 * length.sum():
        return outward
    middle = line.nodes_mm[line.starts, 0].mean()
    return float((normal[:, 0] * length).sum() * (line.nodes_mm[line.starts[mine], 0].mean() - middle))


def _vote(
    line: Polyline, vertices: Floats, faces: Ints32, transform: Floats, side: float
) -> tuple[Floats, Floats]:
    """Per segment: area times cosine of the faces near it, and its total amount."""
    if not len(faces):
        return np.zeros(len(line.starts)), np.zeros(len(line.starts))
    z, r, nz, nr = looks_of(vertices, faces, transform, most=_FACES)
    reach = 2.0 * side
    near = candidates(z, r, line, side_mm=side, slack_mm=0.0, reach_mm=reach)
    foot = feet(z, r, line, near, overshoot_mm=side)
    ok = foot.valid & (np.abs(foot.distance_mm) < reach)
    segment = foot.segment[ok]
    cosine = nz[ok] * line.normals[segment, 0] + nr[ok] * line.normals[segment, 1]
    size = len(line.starts)
    cast = np.bincount(segment, weights=cosine, minlength=size).astype(np.float64)
    return cast, np.bincount(segment, weights=np.abs(cosine), minlength=size).astype(np.float64)


def looks_of(vertices: Floats, faces: Ints32, transform: Floats, *, most: int = 20_000) -> Looks:
    """Where faces are in the (z, r) plane and how they look, evenly thinned to ``most``. O(most)."""
    few = faces[:: max(1, len(faces) // most)]
    corners = placed(transform, vertices[few].reshape(-1, 3)).reshape(-1, 3, 3)
    x, y, z = corners.mean(axis=1).T
    nx, ny, nz = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).T
    r = np.hypot(x, y)
    return z, r, nz, (nx * x + ny * y) / (r + 1e-300)
