"""Light paths of camera samples, as Dr.Jit expressions: the first surface, and interreflected light.

``mi`` is the activated Mitsuba module: it may be imported only after the renderer has chosen LLVM's library.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import drjit as dr

from scenes.transport.chance import Chance
from scenes.transport.optics import Optics
from scenes.transport.rays import Lit, camera_rays, projected_light
from scenes.transport.turn import Guided, turned

PASS_SAMPLES = 1 << 21
"""Paths traced together: bounds the memory of a pass at a few hundred megabytes."""

CAMERA_LENS = 0
"""The first kind of random number, of two, of the camera's lens."""
_FIRST_TURN = 4
"""The first kind of random number of the first turn. Two before it are free: with less, all light changes."""
_NUMBERS_A_TURN = 7
"""Kinds of random numbers (:class:`Chance`): the camera's lens, then at every turn its choice and direction,
the projector's lens, and the place within a projector pixel's blur."""


def choice_kind(turn: int) -> int:
    """The kind of random number that says which way a turn's direction is chosen."""
    return _FIRST_TURN + turn * _NUMBERS_A_TURN


class Paths(Protocol):
    """What is known of some paths beforehand."""

    def uniform(self, turn: int, path: Any) -> tuple[Any, Any] | None:
        """Numbers of paths for a turn: which way to choose the direction (1D), the direction (2D)."""

    def guided(self, turn: int, path: Any) -> Guided | None:
        """Where paths are expected to find light."""


class Arrival(NamedTuple):
    """Interreflected light of one bounce, of the paths that bring any.

    ``path``: which, ascending. ``pixel``: the flat projector pixel that the light comes from. ``weight``: how
    much. ``directions``: where the path went at each of its turns.
    """

    path: Any
    pixel: Any
    weight: Any
    directions: list[Any]


class Bounced(NamedTuple):
    """Interreflected light of paths.

    ``arrivals``: light of 2, 3, … surfaces. ``left``: paths, and the throughput of those of them that leave
    the scene after 1, 2, … surfaces, which is what a uniform surround of radiance 1 sends.
    """

    arrivals: list[Arrival]
    left: list[tuple[Any, Any]]


def first_surface(
    mi: Any, scene: Any, optics: Optics, column: Any, row: Any, lens: Any, *, paths_each: int = 1
) -> Any:
    """What the camera sees at pixel coordinates: a surface interaction, for ``paths_each`` paths in a row.

    ``lens`` is where the rays pass it, see :func:`on_lens`.
    """
    ray = camera_rays(mi, optics, column, row, lens)
    hit = scene.ray_intersect_preliminary(ray, coherent=True)
    if paths_each == 1:
        return hit.compute_surface_interaction(ray)
    dr.eval(ray.o, ray.d, hit)
    return surface_at(mi, ray, hit, dr.arange(mi.UInt32, dr.width(column) * paths_each) // paths_each)


def direct_light(mi: Any, scene: Any, optics: Optics, si: Any, lens: Any) -> Lit:
    """Light of the projector, through places ``lens`` of its own, at the first surface."""
    return projected_light(mi, scene, optics, si, lens, si.is_valid())


def later_surfaces(
    mi: Any,
    scene: Any,
    optics: Optics,
    si: Any,
    chance: Chance,
    bounces: int,
    *,
    paths: Paths | None = None,
) -> Bounced:
    """Interreflected light that reaches the camera from interaction ``si``.

    At each surface the projector is asked (next-event estimation). Most paths leave the scene at a turn:
    those that go on are gathered together before anything else is asked of them, which halves the time.

    Parameters
    ----------
    mi, scene, optics
        As of :func:`scenes.transport.trace.trace`.
    si
        The first surface.
    chance
        Random numbers of the paths.
    bounces
        Surface interactions of the longest path.
    paths
        Better random numbers for the first turns, and where they are expected to find light.

    """
    arrivals: list[Arrival] = []
    left: list[tuple[Any, Any]] = []
    went: list[Any] = []
    path, throughput = dr.arange(mi.UInt32, dr.width(chance.number)), mi.Float(1.0)
    for turn in range(max(bounces - 1, 1)):
        kind = choice_kind(turn)
        uniform = paths.uniform(turn, path) if paths else None
        uniform = uniform or (chance.one(mi, kind), chance.two(mi, kind + 1))
        alive = si.is_valid()
        towards, weight = turned(mi, si, paths.guided(turn, path) if paths else None, *uniform, alive)
        throughput = dr.select(alive, throughput * weight, 0.0)
        alive = throughput > 0.0
        ray = si.spawn_ray(towards)
        hit = scene.ray_intersect_preliminary(ray, active=alive)
        met = alive & hit.is_valid()
        dr.eval(met, throughput, ray.o, ray.d, hit, *(list(one) for one in arrivals[-1:]))
        left.append((path, dr.select(met, 0.0, throughput)))
        kept: Any = dr.compress(met)
        if turn == bounces - 1 or dr.width(kept) == 0:
            break
        path, chance = dr.gather(mi.UInt32, path, kept), chance.of(mi, kept)
        throughput = dr.gather(mi.Float, throughput, kept)
        si = surface_at(mi, ray, hit, kept)
        went = [dr.gather(mi.Vector3f, one, kept) for one in [*went, ray.d]]
        lens = on_lens(mi, optics.projector_aperture_mm, chance.two(mi, kind + 3))
        lit = projected_light(mi, scene, optics, si, lens, si.is_valid())
        pixel, weight = _one_pixel(mi, optics, lit, throughput, chance.two(mi, kind + 5))
        arrivals.append(Arrival(path, pixel, weight, went))
    return Bounced([_with_light(mi, one) for one in arrivals], left)


def surface_at(mi: Any, ray: Any, hit: Any, kept: Any) -> Any:
    """The surface interactions of the hits at places ``kept``."""
    ray = mi.Ray3f(dr.gather(mi.Point3f, ray.o, kept), dr.gather(mi.Vector3f, ray.d, kept))
    return dr.gather(mi.PreliminaryIntersection3f, hit, kept).compute_surface_interaction(ray)


def on_lens(mi: Any, aperture_mm: float, square: Any) -> Any:
    """The point on the unit disc that one on the unit square becomes, or nothing for a pinhole.

    Concentric (Shirley & Chiu 1997): what mirrors the square through its centre mirrors the disc.
    """
    return mi.warp.square_to_uniform_disk_concentric(square) if aperture_mm else None


def _with_light(mi: Any, all_of_them: Arrival) -> Arrival:
    """The paths with light."""
    path, pixel, weight, directions = all_of_them
    dr.eval(path, pixel, weight, directions)
    kept: Any = dr.compress(weight > 0.0)
    return Arrival(
        dr.gather(mi.UInt32, path, kept),
        dr.gather(mi.UInt32, pixel, kept),
        dr.gather(mi.Float, weight, kept),
        [dr.gather(mi.Vector3f, one, kept) for one in directions],
    )


def _one_pixel(mi: Any, optics: Optics, lit: Lit, throughput: Any, within: Any) -> tuple[Any, Any]:
    """One projector pixel for each sample, drawn by how much each lights the place, and the light.

    A pixel's profile is a box (its lit part) blurred by a box (the lens): the place is moved at random within
    the blur, and the pixel in whose lit part it falls gives all the light. Unbiased, at one entry of the
    matrix for a sample instead of four.
    """
    profile, (height, width) = optics.profile, optics.rig.projector.shape
    moved = within - 0.5
    column, column_lit = _pixel_at(mi, lit.u_px + profile.blur_px * moved.x, profile.fill)
    row, row_lit = _pixel_at(mi, lit.v_px + profile.blur_px * moved.y, profile.fill)
    inside = (column >= 0) & (column < width) & (row >= 0) & (row < height) & column_lit & row_lit
    weight = dr.select(inside, lit.weight * throughput * (1.0 / profile.fill**2), 0.0)
    return dr.select(weight > 0.0, mi.UInt32(row * width + column), 0), weight


def _pixel_at(mi: Any, place: Any, fill: float) -> tuple[Any, Any]:
    """The pixel nearest to a coordinate, and whether the coordinate lies in its lit part."""
    pixel = mi.Int32(dr.floor(place + 0.5))
    return pixel, dr.abs(place - mi.Float(pixel)) <= 0.5 * fill
