"""Ordinary parts as closed meshes, drawn at random: wheels, plates, vases, cylinders, treads, spokes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from bench.synthetic.revolution import reached
from burrscan.arrays import Floats, Ints32

Mesh = tuple[Floats, Ints32]
Random = np.random.Generator
Lift = Callable[[Floats, Floats, Floats], Floats]
_AROUND, _ALONG = 720, 90
"""Vertices on a parallel, and steps along an outline."""


def turned(outline_zr: Floats, *, around: int = _AROUND, lift: Lift | None = None) -> Mesh:
    """A part of revolution.

    Parameters
    ----------
    outline_zr
        (K, 2) points (z, r), mm; closed, or with both ends on the axis.
    around
        Vertices on a parallel.
    lift
        Of z and r of the outline (N, 1) and angles (1, M): what the radius is multiplied by, (N, M).

    """
    length = reached(outline_zr)
    at = np.unique(np.concatenate([np.linspace(0.0, length[-1], _ALONG), length]))
    z, r = (np.interp(at, length, column)[:, None] for column in outline_zr.T)
    angle = np.arange(around)[None] * 2.0 * np.pi / around
    radius = r * (np.ones_like(angle) if lift is None else lift(z, r, angle))
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), z + 0.0 * radius], axis=-1)
    return points.reshape(-1, 3), ring_faces(len(at), around)


def ring_faces(rings: int, around: int) -> Ints32:
    """Triangles between closed rings of so many vertices each, the rings one after the other."""
    row, column = np.meshgrid(np.arange(rings - 1), np.arange(around), indexing="ij")
    here, ahead = row * around + column, row * around + (column + 1) % around
    first = np.stack([here, ahead, here + around], axis=-1).reshape(-1, 3)
    second = np.stack([ahead, ahead + around, here + around], axis=-1).reshape(-1, 3)
    return np.concatenate([first, second]).astype(np.int32)


def closed(points_zr: list[tuple[float, float]]) -> Floats:
    """An outline without points that coincide, which ends where it begins or on the axis."""
    points = np.array(points_zr, dtype=np.float64)
    points = points[np.concatenate([[True], np.hypot(*np.diff(points, axis=0).T) > 1e-9])]
    return points if points[0, 1] == points[-1, 1] == 0.0 else np.concatenate([points, points[:1]])


def wheel(rng: Random) -> Mesh:
    """One to four steps and slopes, a bore; most with a hollow in one face."""
    wide, radius, bore = rng.uniform(20.0, 90.0), rng.uniform(70.0, 110.0), rng.uniform(5.0, 20.0)
    steps = int(rng.integers(1, 5))
    places = np.linspace(-0.5 * wide, 0.5 * wide, steps + 1)
    outline = [(-0.5 * wide, bore)]
    for start, end in pairwise(places):
        level = rng.uniform(0.7, 1.0) * radius
        outline += [(start, level), (end, level + rng.uniform(-0.04, 0.04) * radius)]
    if rng.random() < 0.6:
        hollow = ((0.5, 0.6), (0.2, 0.58), (0.2, 0.3), (0.6, 0.25))
        outline += [(z * wide, r * radius) for z, r in hollow]
    return turned(closed([*outline, (outline[-1][0], bore)]))


def plate(rng: Random) -> Mesh:
    """A disc, with or without a bore, a chamfer and a boss."""
    radius, thick, tall = rng.uniform(60.0, 120.0), rng.uniform(3.0, 15.0), rng.uniform(5.0, 25.0)
    bore = rng.uniform(5.0, 20.0) if rng.random() < 0.8 else 0.0
    outline = [(0.0, bore), (0.0, radius)]
    if rng.random() < 0.5:
        outline.append((0.6 * thick, radius + rng.uniform(0.0, 1.0)))
    boss = rng.uniform(0.5, 0.9) * radius
    outline += [(thick, radius), (thick, boss)]
    if rng.random() < 0.7:
        outline += [(thick + tall, boss - rng.uniform(0.0, 10.0)), (thick + tall, 0.3 * radius)]
    return turned(closed([*outline, (outline[-1][0], bore)]))


def vase(rng: Random) -> Mesh:
    """A waved body, hollow from above to some depth, walls of 2 to 6 mm."""
    tall, wall = rng.uniform(60.0, 220.0), rng.uniform(2.0, 6.0)
    z, r = waved(rng)
    inside = z[::-1] > rng.uniform(-0.4, 0.3)
    inner = np.stack([tall * z[::-1][inside], np.maximum(r[::-1][inside] - wall, 4.0)], axis=1)
    outer = np.stack([tall * z, r], axis=1)
    ends = (outer[0, 0], 0.0), (inner[-1, 0], 0.0)
    return turned(closed([ends[0], *map(tuple, outer), *map(tuple, inner), ends[1]]))


def waved(rng: Random) -> tuple[Floats, Floats]:
    """A waved outline: z from -0.5 to 0.5, and radii, mm."""
    z = np.linspace(-0.5, 0.5, 60)
    waves = rng.uniform(5.0, 18.0) * np.sin(rng.uniform(3.0, 8.0) * z + rng.uniform(0.0, 6.0))
    waves += rng.uniform(0.0, 5.0) * np.sin(15.0 * z + rng.uniform(0.0, 6.0))
    return z, np.maximum(rng.uniform(35.0, 55.0) + waves, 10.0)


def cylinder(rng: Random) -> Mesh:
    """A cylinder or a cone with chamfered ends."""
    return turned(cylinder_outline(rng))


def cylinder_outline(rng: Random) -> Floats:
    """(K, 2) points (z, r) of a cylinder or a cone, mm."""
    tall, radius, chamfer = rng.uniform(30.0, 250.0), rng.uniform(30.0, 60.0), rng.uniform(0.0, 4.0)
    top = radius * (1.0 + rng.uniform(-0.3, 0.3) * (rng.random() < 0.5))
    return closed([
        (0.0, 0.0), (0.0, radius - chamfer), (chamfer, radius), (tall - chamfer, top), (tall, top - chamfer),
        (tall, 0.0),
    ])  # fmt: skip


def treaded(rng: Random) -> Mesh:
    """A tyre with 10 to 60 lugs, 1 to 6 % of the radius deep, straight or aslant."""
    wide, radius, bevel = rng.uniform(25.0, 120.0), rng.uniform(60.0, 110.0), rng.uniform(0.0, 8.0)
    count, deep, duty = int(rng.integers(10, 60)), rng.uniform(0.01, 0.06), rng.uniform(-0.3, 0.5)
    slope, mirrored = rng.uniform(-2.0, 2.0) / radius, rng.random() < 0.5

    def lift(z: Floats, r: Floats, angle: Floats) -> Floats:
        along = np.abs(z) if mirrored else z
        lug = np.sin(count * (angle + slope * along)) > duty
        return np.where(r > radius - bevel - 1e-6, 1.0 - deep * ~lug, 1.0)

    half = 0.5 * wide
    outline = closed([
        (-half, 0.15 * radius), (-half, radius - bevel), (bevel - half, radius), (half - bevel, radius),
        (half, radius - bevel), (half, 0.55 * radius), (0.3 * wide, 0.5 * radius),
        (0.3 * wide, 0.15 * radius),
    ])  # fmt: skip
    return turned(outline, around=2 * _AROUND, lift=lift)


def spoked(rng: Random) -> Mesh:
    """A rim and a hub, joined by three to ten bars."""
    wide, radius = rng.uniform(15.0, 60.0), rng.uniform(70.0, 110.0)
    thick, hub = rng.uniform(0.08, 0.25) * radius, rng.uniform(0.15, 0.35) * radius
    half, half_hub = 0.5 * wide, 0.5 * wide * rng.uniform(0.4, 1.5)
    rim = [(-half, radius - thick), (-half, radius), (half, radius), (half, radius - thick)]
    middle = [(-half_hub, 4.0), (-half_hub, hub), (half_hub, hub), (half_hub, 4.0)]
    count, across = int(rng.integers(3, 11)), rng.uniform(0.03, 0.12) * radius
    high, off = rng.uniform(0.1, 0.45) * wide, rng.uniform(-0.2, 0.2) * wide
    bar = box((0.8 * hub, radius - 0.8 * thick), (-across, across), (off - high, off + high))
    turns = Rotation.from_euler("z", np.arange(count)[:, None] * 360.0 / count, degrees=True)
    bars = [(bar[0] @ turn.as_matrix().T, bar[1]) for turn in turns]
    return joined([turned(closed(rim)), turned(closed(middle)), *bars])


def box(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float]) -> Mesh:
    """A box between two corners."""
    points = np.array([[i, j, k] for i in x for j in y for k in z])
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return points, np.array([face for a, b, c, d in sides for face in ((a, b, c), (a, c, d))], dtype=np.int32)


def joined(parts: list[Mesh]) -> Mesh:
    """Several meshes as one; they may run into each other."""
    first = np.cumsum([0, *(len(vertices) for vertices, _ in parts[:-1])])
    faces = [faces + start for (_, faces), start in zip(parts, first, strict=True)]
    return np.concatenate([vertices for vertices, _ in parts]), np.concatenate(faces).astype(np.int32)


PARTS: Mapping[str, Callable[[Random], Mesh]] = {
    "wheels": wheel,
    "plates": plate,
    "vases": vase,
    "cylinders": cylinder,
    "treads": treaded,
    "spokes": spoked,
}
"""Kinds of parts; the first four are surfaces of revolution."""
