"""The outline of a wheel's half section: a polygon with filleted corners and exact normals.

In the (z, r) plane the outline is walked with +z on the wheel's outside, so the material lies to the right
and the outward normal of a segment along (dz, dr) is (-dr, dz).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from burrscan.arrays import Bools, Floats, Ints, freeze
from burrscan.errors import InputError
from scenes.wheel.spec import WheelSpec

_SAME_MM = 1e-6
"""Points nearer than a nanometre are one: rounding, and nothing that anybody draws."""
_SMOOTH = 1.0 - 1e-9
"""Cosine of 0.003°: exact normals of two smoothly joined segments differ by rounding only."""


@dataclass(frozen=True)
class Outline:
    """Straight segments along the exact outline, each with the exact normals at its two ends.

    Parameters
    ----------
    start_zr, end_zr
        (S, 2) segments in order, mm; a solid wheel's run begins and ends on the axis, a bored wheel's closes.
    start_normal_zr, end_normal_zr
        (S, 2) unit outward normals of the exact curve at those ends.
    vertices_zr
        (N, 2) the sharp vertices, in the order of the specification.
    edge_after, edge_before
        (N, 2, 2) the straight parts (start, end) of the two edges at each vertex, after fillets, both leading
        away from the vertex.
    edge_normal_after, edge_normal_before
        (N, 2) their outward normals.

    """

    start_zr: Floats
    end_zr: Floats
    start_normal_zr: Floats
    end_normal_zr: Floats
    vertices_zr: Floats
    edge_after: Floats
    edge_before: Floats
    edge_normal_after: Floats
    edge_normal_before: Floats

    def __post_init__(self) -> None:
        freeze(self, **vars(self))

    @property
    def curve_zr(self) -> Floats:
        """(S + 1, 2) the points along it; a bored wheel's last point is its first."""
        return np.vstack([self.start_zr, self.end_zr[-1:]])

    @property
    def smooth_joint(self) -> Bools:
        """(S,) whether each segment goes smoothly into the next; False after the last."""
        joint = np.einsum("ij,ij->i", self.end_normal_zr, np.roll(self.start_normal_zr, -1, axis=0)) > _SMOOTH
        joint[-1] = False
        return np.asarray(joint)


def wheel_outline(spec: WheelSpec, *, chord_error_mm: float) -> Outline:
    """Read a specification's outline, round its corners, and check that a body can be turned from it.

    Parameters
    ----------
    spec
        The wheel.
    chord_error_mm
        Largest distance between a fillet's arc and its chords.

    Raises
    ------
    InputError
        For fewer than three vertices, r < 0, repeated vertices, an outline that crosses or touches itself, a
        fillet larger than its edges, or a contact with the axis that is not one edge.

    """
    polygon = np.array([vertex[:2] for vertex in spec.generatrix], float).reshape(-1, 2)
    fillets = np.array([vertex[2] if len(vertex) == 3 else 0.0 for vertex in spec.generatrix], float)
    _check(polygon, fillets, spec.name)
    order = _walking_order(polygon)
    tangents = _tangent_lengths(polygon[order], fillets[order], spec.name, order)
    return _assemble(polygon[order], fillets[order], tangents, chord_error_mm, order)


def divided(outline: Outline, cuts_mm: Sequence[float]) -> Outline:
    """The same outline with its segments cut in two at positions along the axis; O(segments × cuts)."""
    for cut in cuts_mm:
        z = np.stack([outline.start_zr[:, 0], outline.end_zr[:, 0]])
        across = np.flatnonzero((z.min(axis=0) < cut - _SAME_MM) & (z.max(axis=0) > cut + _SAME_MM))
        share = ((cut - z[0]) / np.where(z[0] == z[1], 1.0, z[1] - z[0]))[across, None]
        start, end = outline.start_zr[across], outline.end_zr[across]
        normals = outline.start_normal_zr[across] * (1.0 - share) + outline.end_normal_zr[across] * share
        at, normals = start + (end - start) * share, _unit(normals)
        outline = replace(
            outline,
            start_zr=np.insert(outline.start_zr, across + 1, at, axis=0),
            start_normal_zr=np.insert(outline.start_normal_zr, across + 1, normals, axis=0),
            end_zr=np.insert(outline.end_zr, across, at, axis=0),
            end_normal_zr=np.insert(outline.end_normal_zr, across, normals, axis=0),
        )
    return outline


def _check(polygon: Floats, fillets: Floats, name: str) -> None:
    if len(polygon) < 3:
        raise InputError(f"wheel '{name}': a generatrix needs at least 3 vertices, got {len(polygon)}")
    if not np.isfinite(polygon).all():
        raise InputError(f"wheel '{name}': the generatrix holds a value that is not a number")
    for index, (z, r) in enumerate(polygon):
        if r < 0.0:
            raise InputError(
                f"wheel '{name}': vertex {index} (z {z:g}, r {r:g}) lies beyond the axis; r must be >= 0"
            )
    repeated = np.linalg.norm(np.roll(polygon, -1, axis=0) - polygon, axis=1) < _SAME_MM
    if repeated.any():
        raise InputError(
            f"wheel '{name}': vertex {int(np.argmax(repeated))} is repeated by the one after it; remove one "
            "(the outline closes by itself)"
        )
    _check_axis(polygon, fillets, name)
    _check_crossings(polygon, name)


def _check_axis(polygon: Floats, fillets: Floats, name: str) -> None:
    on_axis = polygon[:, 1] == 0.0
    edges = on_axis & np.roll(on_axis, -1)
    if on_axis.any() and not (on_axis.sum() == 2 and edges.any()):
        raise InputError(
            f"wheel '{name}': the outline must meet the axis in exactly one edge (two neighbouring "
            f"vertices with r = 0), or not at all; vertices on the axis: {np.flatnonzero(on_axis).tolist()}"
        )
    if (fillets[on_axis] > 0.0).any():
        raise InputError(f"wheel '{name}': a vertex on the axis cannot have a fillet")


def _check_crossings(polygon: Floats, name: str) -> None:
    """Every pair of edges that are not neighbours, and neighbours that fold back. O(N²)."""
    n = len(polygon)
    ends = np.roll(polygon, -1, axis=0)
    for i in range(n):
        for j in range(i + 1, n):
            neighbours = j == i + 1 or (i == 0 and j == n - 1)
            if not neighbours and _touch(polygon[i], ends[i], polygon[j], ends[j]):
                raise InputError(
                    f"wheel '{name}': the outline crosses or touches itself: edge {i}-{(i + 1) % n} meets "
                    f"edge {j}-{(j + 1) % n}"
                )
    along = ends - polygon
    after = np.roll(along, -1, axis=0)
    folded = (np.abs(_cross(along, after)) < 1e-9) & (np.einsum("ij,ij->i", along, after) < 0.0)
    if folded.any():
        raise InputError(
            f"wheel '{name}': the outline folds back on itself at vertex {int(np.argmax(folded)) + 1}"
        )


def _touch(a: Floats, b: Floats, c: Floats, d: Floats) -> bool:
    """Whether two closed line segments have a point in common."""
    sides = [float(_cross(q - p, s - p)) for p, q, s in ((a, b, c), (a, b, d), (c, d, a), (c, d, b))]
    if sides[0] * sides[1] < 0.0 and sides[2] * sides[3] < 0.0:
        return True
    pairs = ((sides[0], a, b, c), (sides[1], a, b, d), (sides[2], c, d, a), (sides[3], c, d, b))
    return any(side == 0.0 and _between(p, q, s) for side, p, q, s in pairs)


def _between(p: Floats, q: Floats, s: Floats) -> bool:
    return bool(np.all(s >= np.minimum(p, q)) and np.all(s <= np.maximum(p, q)))


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def _walking_order(polygon: Floats) -> Ints:
    """Indices that walk the outline with the material to the right; an edge on the axis comes last."""
    order = np.arange(len(polygon))
    area = 0.5 * _cross(polygon, np.roll(polygon, -1, axis=0)).sum()
    if area > 0.0:
        order = order[::-1]
    on_axis = polygon[order, 1] == 0.0
    start = np.flatnonzero(np.roll(on_axis, 1) & on_axis)
    return np.roll(order, -int(start[0])) if len(start) else order


def _tangent_lengths(polygon: Floats, fillets: Floats, name: str, order: Ints) -> Floats:
    """(N,) distance from each vertex to where its fillet begins."""
    into = _unit(polygon - np.roll(polygon, 1, axis=0))
    out = np.roll(into, -1, axis=0)
    turn = np.arctan2(_cross(into, out), np.einsum("ij,ij->i", into, out))
    lengths = fillets * np.tan(np.abs(turn) / 2.0)
    edges = np.linalg.norm(np.roll(polygon, -1, axis=0) - polygon, axis=1)
    needed = lengths + np.roll(lengths, -1)
    for i in np.flatnonzero(needed > edges + 1e-9):
        a, b = int(order[i]), int(order[(i + 1) % len(order)])
        raise InputError(
            f"wheel '{name}': the fillets at vertices {a} and {b} need {needed[i]:.3g} mm of an edge that is "
            f"{edges[i]:.3g} mm long; make them smaller"
        )
    return np.asarray(lengths)


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def _assemble(polygon: Floats, fillets: Floats, lengths: Floats, error_mm: float, order: Ints) -> Outline:
    along = _unit(np.roll(polygon, -1, axis=0) - polygon)
    normals = np.stack([-along[:, 1], along[:, 0]], axis=1)
    leave = polygon + along * lengths[:, None]
    arrive = np.roll(polygon - np.roll(along, 1, axis=0) * lengths[:, None], -1, axis=0)
    rows = [
        part
        for i in range(len(polygon))
        for part in (
            *_arc(np.roll(arrive, 1, axis=0)[i], normals[i - 1], normals[i], fillets[i], error_mm),
            (leave[i], arrive[i], normals[i], normals[i]),
        )
    ]
    rows = [row for row in rows if np.linalg.norm(row[1] - row[0]) > _SAME_MM and row[0][1] + row[1][1] > 0.0]
    start, end, start_normal, end_normal = (np.array(column) for column in zip(*rows, strict=True))
    end = _closed(start, end)
    before = np.stack([np.roll(arrive, 1, axis=0), np.roll(leave, 1, axis=0)], axis=1)
    back = np.argsort(order)
    return Outline(
        start_zr=start,
        end_zr=end,
        start_normal_zr=start_normal,
        end_normal_zr=end_normal,
        vertices_zr=polygon[back],
        edge_after=np.stack([leave, arrive], axis=1)[back],
        edge_before=before[back],
        edge_normal_after=normals[back],
        edge_normal_before=np.roll(normals, 1, axis=0)[back],
    )


def _closed(start: Floats, end: Floats) -> Floats:
    """Let each segment end bit for bit where the next one starts; a run between axis points stays open."""
    joined = np.roll(start, -1, axis=0)
    if end[-1, 1] == 0.0:
        joined[-1] = end[-1]
    return joined


def _arc(
    start: Floats, normal: Floats, next_normal: Floats, radius: float, error_mm: float
) -> list[tuple[Floats, Floats, Floats, Floats]]:
    """Chords of a fillet from ``start``, where the outline's normal is ``normal``, to ``next_normal``."""
    turn = float(np.arctan2(_cross(normal, next_normal), normal @ next_normal))
    if radius == 0.0 or turn == 0.0:
        return []
    # turning left (counter-clockwise) the curve is concave: its centre lies outside the material
    towards_surface = 1.0 if turn < 0.0 else -1.0
    centre = start - normal * radius * towards_surface
    step = 2.0 * np.arccos(max(1.0 - error_mm / radius, 0.0))
    angles = np.arctan2(normal[1], normal[0]) + np.linspace(0.0, turn, int(np.ceil(abs(turn) / step)) + 1)
    normals = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    points = centre + normals * radius * towards_surface
    return list(zip(points[:-1], points[1:], normals[:-1], normals[1:], strict=True))
