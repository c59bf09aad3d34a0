"""Light paths of camera samples, as Dr.Jit expressions: the first surface, and interreflected light.

``mi`` is the activated Mitsuba module: it may be imported only after the renderer has chosen LLVM's library.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import drjit as dr

from scenes.transport.optics import Optics
from scenes.transport.rays import Lit, camera_rays, projected_light
from scenes.transport.turn import Target, turned

PASS_SAMPLES = 1 << 22
"""Paths traced together: bounds the memory of a pass at a few hundred megabytes."""


class Arrival(NamedTuple):
    """Interreflected light of one bounce: the flat projector pixel that it comes from, and how much."""

    pixel: Any
    weight: Any


class Bounced(NamedTuple):
    """Interreflected light of paths.

    ``arrivals``: light of 2, 3, … surfaces. ``surround``: throughput of the paths of fewer surfaces that
    leave the scene, which is what a uniform surround of radiance 1 sends. ``places_mm``: the surface that
    each bounce meets.
    """

    arrivals: list[Arrival]
    surround: Any
    places_mm: list[Any]


def first_surface(mi: Any, scene: Any, optics: Optics, column: Any, row: Any, sampler: Any) -> Any:
    """What the camera sees at pixel coordinates: a surface interaction."""
    lens = on_lens(mi, optics.camera_aperture_mm, sampler)
    return scene.ray_intersect(camera_rays(mi, optics, column, row, lens))


def later_surfaces(
    mi: Any,
    scene: Any,
    optics: Optics,
    si: Any,
    uniform: tuple[Any, Any],
    sampler: Any,
    bounces: int,
    *,
    aims: Sequence[Target] = (),
) -> Bounced:
    """Interreflected light that reaches the camera from interaction ``si``.

    At each surface the projector is asked (next-event estimation).

    Parameters
    ----------
    mi, scene, optics
        As of :func:`scenes.transport.trace.trace`.
    si
        The first surface.
    uniform
        Random numbers of the first turn: which way to choose the direction (1D), and the direction (2D).
    sampler
        Of all further random numbers.
    bounces
        Surface interactions of the longest path.
    aims
        What the first turns aim at; without, and at later turns, the direction is drawn from the BSDF.

    """
    arrivals, places, surround = [], [], mi.Float(0.0)
    throughput, active = mi.Float(1.0), si.is_valid()
    for turn in range(max(bounces - 1, 1)):
        aim = aims[turn] if turn < len(aims) else None
        towards, weight = turned(mi, si, aim, *uniform, active)
        throughput = throughput * weight
        active &= throughput > 0.0
        si = scene.ray_intersect(si.spawn_ray(towards), active)
        surround += dr.select(active & ~si.is_valid(), throughput, 0.0)
        active &= si.is_valid()
        if turn < bounces - 1:
            lens = on_lens(mi, optics.projector_aperture_mm, sampler)
            lit = projected_light(mi, scene, optics, si, lens, active)
            arrivals.append(_one_pixel(mi, optics, lit, throughput, sampler))
            places.append(si.p)
            uniform = sampler.next_1d(active), sampler.next_2d(active)
    return Bounced(arrivals, surround, places)


def on_lens(mi: Any, aperture_mm: float, sampler: Any) -> Any:
    """A point on the unit disc, or nothing for a pinhole."""
    return mi.warp.square_to_uniform_disk(sampler.next_2d()) if aperture_mm else None


def _one_pixel(mi: Any, optics: Optics, lit: Lit, throughput: Any, sampler: Any) -> Arrival:
    """One projector pixel for each sample, drawn by how much each lights the place.

    A pixel's profile is a box (its lit part) blurred by a box (the lens): the place is moved at random within
    the blur, and the pixel in whose lit part it falls gives all the light. Unbiased, at one entry of the
    matrix for a sample instead of four.
    """
    profile, (height, width) = optics.profile, optics.rig.projector.shape
    moved = sampler.next_2d() - 0.5
    column, column_lit = _pixel_at(mi, lit.u_px + profile.blur_px * moved.x, profile.fill)
    row, row_lit = _pixel_at(mi, lit.v_px + profile.blur_px * moved.y, profile.fill)
    inside = (column >= 0) & (column < width) & (row >= 0) & (row < height) & column_lit & row_lit
    weight = dr.select(inside, lit.weight * throughput * (1.0 / profile.fill**2), 0.0)
    return Arrival(dr.select(weight > 0.0, mi.UInt32(row * width + column), 0), weight)


def _pixel_at(mi: Any, place: Any, fill: float) -> tuple[Any, Any]:
    """The pixel nearest to a coordinate, and whether the coordinate lies in its lit part."""
    pixel = mi.Int32(dr.floor(place + 0.5))
    return pixel, dr.abs(place - mi.Float(pixel)) <= 0.5 * fill
