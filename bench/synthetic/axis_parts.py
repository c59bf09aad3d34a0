"""Parts that tempt an axis: round ones, short ones, and such as are not round all over."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from bench.synthetic.ordinary_parts import (
    Mesh,
    Random,
    closed,
    cylinder,
    cylinder_outline,
    joined,
    ring_faces,
    spoked,
    treaded,
    turned,
    vase,
    waved,
    wheel,
)
from burrscan.arrays import Floats

_FINE = 1440
"""Vertices on a parallel of a part with flutes: 45 a flute at least."""
_TUBE = 24
"""Vertices on a cross-section of a handle."""


def plain(rng: Random) -> Mesh:
    """A wheel, a vase, a cylinder or a cone."""
    shape = (wheel, vase, cylinder)[int(rng.integers(3))]
    return shape(rng)


def short(rng: Random) -> Mesh:
    """A wheel, a cylinder or a cone, pressed to a tenth to four tenths of its length."""
    vertices, faces = (wheel, cylinder)[int(rng.integers(2))](rng)
    return vertices * (1.0, 1.0, rng.uniform(0.1, 0.4)), faces


def fluted(rng: Random) -> Mesh:
    """A solid vase, a cylinder or a cone with 5 to 32 flutes, 1 to 9 % of the radius deep; some twisted."""
    outline = _body_outline(rng) if rng.random() < 0.7 else cylinder_outline(rng)
    count = int(rng.integers(5, 33))
    deep = rng.uniform(0.01, 0.09) * min(1.0, 14.0 / count)
    twist = rng.uniform(-0.01, 0.01) * (rng.random() < 0.3)  # radians per mm
    form, margin = int(rng.integers(3)), rng.uniform(0.0, 0.2)
    low, high = outline[:, 0].min(), outline[:, 0].max()

    def lift(z: Floats, r: Floats, angle: Floats) -> Floats:  # noqa: ARG001 (flutes are as deep everywhere)
        turn = count * (angle + twist * z)
        wave = (np.cos(turn), 1.0 - 2.0 * np.abs(np.sin(0.5 * turn)), 2.0 * np.abs(np.sin(0.5 * turn)) - 1.0)
        within = (z > low + margin * (high - low)) & (z < high - margin * (high - low))
        return np.asarray(1.0 + deep * wave[form] * within)

    return turned(outline, around=_FINE, lift=lift)


def handled(rng: Random) -> Mesh:
    """A solid vase, a cylinder or a cone with a handle; three in ten with a second one opposite.

    Handles end in the wall: nothing of them stands in the hollow of a mouth.
    """
    outline = _body_outline(rng) if rng.random() < 0.5 else cylinder_outline(rng)
    tall, radius = float(np.ptp(outline[:, 0])), float(outline[:, 1].max())
    out, half = rng.uniform(0.3, 0.8) * radius, rng.uniform(0.2, 0.45) * tall
    angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 40)
    middle = outline[:, 0].min() + 0.5 * tall
    path = np.stack(
        [0.85 * radius + out * np.cos(angle), np.zeros(40), middle + half * np.sin(angle)], axis=1
    )
    thick = rng.uniform(0.06, 0.15) * radius
    handles = [_tube(path, thick)]
    if rng.random() < 0.3:
        handles.append(_tube(path * (-1.0, 1.0, 1.0), thick))
    return joined([turned(outline), *(_out_of_hollows(handle, outline) for handle in handles)])


def oval(rng: Random) -> Mesh:
    """A plain part that is oval or three-lobed by 0.02 to 0.2 % of the radius: within tolerance."""
    vertices, faces = plain(rng)
    size = 10.0 ** rng.uniform(-3.7, -2.7)
    lobes, turn = int(rng.choice([2, 2, 3])), rng.uniform(0.0, 2.0 * np.pi)
    angle = np.arctan2(vertices[:, 1], vertices[:, 0])
    stretch = 1.0 + size * np.cos(lobes * angle + turn)
    return vertices * np.stack([stretch, stretch, np.ones_like(stretch)], axis=1), faces


def _body_outline(rng: Random) -> Floats:
    """A waved body with a shallow hollow on top, (K, 2) points (z, r), mm.

    The hollow leaves a wall of 4 to 6 mm at the neck: as wide as the mouth, it would come out of the wall.
    """
    tall = rng.uniform(60.0, 220.0)
    z, r = waved(rng)
    outer = [(float(a), float(b)) for a, b in zip(tall * z, r, strict=True)]
    top, floor = 0.5 * tall, 0.2 * tall
    neck = float(r[tall * z >= floor].min())
    hollow = [(top, neck - 4.0), (floor, neck - 6.0), (floor, 0.0)]
    return closed([(-top, 0.0), *outer, *hollow])


def _tube(path: Floats, thick: float) -> Mesh:
    """A tube of radius ``thick`` along a (K, 3) path in a plane y = constant, its ends open."""
    along = np.gradient(path, axis=0)
    along /= np.linalg.norm(along, axis=1)[:, None]
    side = np.array([0.0, 1.0, 0.0])
    across = np.cross(along, side)
    angle = np.arange(_TUBE)[None, :, None] * 2.0 * np.pi / _TUBE
    points = path[:, None] + thick * (np.cos(angle) * across[:, None] + np.sin(angle) * side)
    return points.reshape(-1, 3), ring_faces(len(path), _TUBE)[:, [0, 2, 1]]


def _out_of_hollows(part: Mesh, outline_zr: Floats) -> Mesh:
    """A mesh without its faces in a hollow: outwards of it the outline is crossed more than once."""
    points, faces = part
    z, r = points[:, 2, None], np.hypot(points[:, 0], points[:, 1])[:, None]
    (z0, r0), (z1, r1) = outline_zr[:-1].T, outline_zr[1:].T
    across = (z0 <= z) != (z1 <= z)
    share = np.where(across, z - z0, 0.0) / np.where(z1 == z0, 1.0, z1 - z0)
    crossed = (across & (r0 + share * (r1 - r0) > r)).sum(axis=1)
    hollow = (crossed > 0) & (crossed % 2 == 0)
    return points, faces[~hollow[faces].any(axis=1)]


FAMILIES: Mapping[str, Callable[[Random], Mesh]] = {
    "plain": plain,
    "short": short,
    "flutes": fluted,
    "treads": treaded,
    "spokes": spoked,
    "handles": handled,
    "ovals": oval,
}
"""Kinds of parts whose axis is known."""
