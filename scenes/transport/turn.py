"""One turn of a light path: by the surface's own reflection, or where light is known to come from.

Half of the paths follow a guide, half the reflection; each is weighted by the density of both (one-sample
balance heuristic, Veach & Guibas 1995), which keeps the mean exact whatever the guide says.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import drjit as dr

STRIPS = CELLS = 16
"""A guide is cut into so many strips of equal light, and each into so many cells; powers of two, for they are
searched by halving. 8 leave a seventh more error."""
_SHARE = 0.5
"""Of the paths that follow the guide; the rest bounds the loss of a bad one to a doubled variance. 0.62 and
0.75 leave larger errors where a guide has missed light."""


class Guided(NamedTuple):
    """Where paths are expected to find light, on an equal-area map of the sphere.

    ``known``: whether anything is. ``middle`` and ``side``: the map's centre and first axis. ``number`` of
    each path's guide in the tables ``across`` (STRIPS + 1 edges each, along the first axis) and ``along``
    (STRIPS · (CELLS + 1) edges each, along the second).
    """

    known: Any
    middle: Any
    side: Any
    number: Any
    across: Any
    along: Any

    @property
    def up(self) -> Any:
        """The map's second axis."""
        return dr.cross(self.middle, self.side)


def turned(
    mi: Any, si: Any, guided: Guided | None, choice: Any, direction: Any, active: Any
) -> tuple[Any, Any]:
    """Direction of a path after surface ``si``, in the world, and the factor on what it carries.

    Parameters
    ----------
    mi
        The activated Mitsuba module.
    si
        The surface.
    guided
        Where to; None follows the reflection alone.
    choice, direction
        Random numbers: which way to choose the direction (1D), and the direction (2D).
    active
        Paths that are alive.

    """
    context = mi.BSDFContext()
    if guided is None:
        chosen, weight = si.bsdf().sample(context, si, choice, direction, active)
        return si.to_world(chosen.wo), weight[0]
    share = dr.select(guided.known, mi.Float(_SHARE), 0.0)
    # a branch, for the paths of a pixel that go one way stand in a row, and fill whole vectors of lanes
    wo, guides = dr.if_stmt(
        (si, guided, (choice - share) / (1.0 - share), direction, active),
        choice < share,
        lambda _si, guided, _choice, direction, _active: _by_guide(mi, guided, direction),
        lambda si, guided, choice, direction, active: _by_reflection(
            mi, si, guided, choice, direction, active
        ),
    )
    light, density = si.bsdf().eval_pdf(context, si, si.to_local(wo), active)
    mixed = share * guides + (1.0 - share) * density
    return wo, dr.select(active & (mixed > 0.0), light[0] / mixed, 0.0)


def _by_reflection(
    mi: Any, si: Any, guided: Guided, choice: Any, direction: Any, active: Any
) -> tuple[Any, Any]:
    """A direction by the surface's reflection, and the guide's density there."""
    chosen, _ = si.bsdf().sample(mi.BSDFContext(), si, choice, direction, active)
    wo = si.to_world(chosen.wo)
    return wo, _density(mi, guided, wo)


def _by_guide(mi: Any, guided: Guided, uniform: Any) -> tuple[Any, Any]:
    """A direction by the guide, and its density per solid angle."""
    strip, part = _split(mi, uniform.x, STRIPS)
    low, high = _edges(mi, guided.across, guided.number * (STRIPS + 1) + strip, guided.known)
    a, wide = dr.lerp(low, high, part), high - low
    cell, part = _split(mi, uniform.y, CELLS)
    first = (guided.number * STRIPS + strip) * (CELLS + 1)
    low, high = _edges(mi, guided.along, first + cell, guided.known)
    b = dr.lerp(low, high, part)
    square = dr.minimum(a * a + b * b, 4.0)  # Lambert's azimuthal map
    towards = (guided.side * a + guided.up * b) * dr.sqrt(1.0 - 0.25 * square)
    return dr.normalize(towards + guided.middle * (1.0 - 0.5 * square)), _of_cell(wide, high - low)


def _density(mi: Any, guided: Guided, wo: Any) -> Any:
    """Density of the guide's directions per solid angle."""
    scale = dr.sqrt(2.0 / dr.maximum(1.0 + dr.dot(guided.middle, wo), 1e-4))
    a, b = dr.dot(guided.side, wo) * scale, dr.dot(guided.up, wo) * scale
    strip, wide = _found(mi, guided.across, guided.number * (STRIPS + 1), STRIPS, a, guided.known)
    first = (guided.number * STRIPS + strip) * (CELLS + 1)
    _, high = _found(mi, guided.along, first, CELLS, b, guided.known)
    return _of_cell(wide, high)


def _of_cell(wide: Any, high: Any) -> Any:
    """Density in a cell, each of which holds as many directions; 0 outside of all."""
    return dr.select(wide * high > 0.0, 1.0 / (STRIPS * CELLS * wide * high), 0.0)


def _split(mi: Any, uniform: Any, count: int) -> tuple[Any, Any]:
    """Which of ``count`` equal parts of [0, 1) a number is in, and where in it."""
    part = dr.minimum(mi.UInt32(uniform * count), count - 1)
    return part, uniform * count - mi.Float(part)


def _edges(mi: Any, table: Any, first: Any, active: Any) -> tuple[Any, Any]:
    return dr.gather(mi.Float, table, first, active), dr.gather(mi.Float, table, first + 1, active)


def _found(mi: Any, table: Any, first: Any, count: int, place: Any, active: Any) -> tuple[Any, Any]:
    """Which of ``count`` intervals from entry ``first`` on holds a place, and its width; 0 if none does."""
    number, step = mi.UInt32(0), count // 2
    while step:
        beyond = place >= dr.gather(mi.Float, table, first + number + step, active)
        number = dr.select(beyond, number + step, number)
        step //= 2
    low, high = _edges(mi, table, first + number, active)
    return number, dr.select((place >= low) & (place < high) & active, high - low, 0.0)
