"""Tracing a scene once: from every camera pixel along light paths to the projector pixels that feed it."""

from __future__ import annotations

from typing import Any, NamedTuple

import drjit as dr
import numpy as np

from burrscan.arrays import Bools, Floats32, Ints, Ints32
from scenes.transport.footprint import sample_sets
from scenes.transport.hits import may_see
from scenes.transport.matrix import LightTransport
from scenes.transport.optics import Optics
from scenes.transport.rays import Lit, camera_rays, projected_light
from scenes.transport.rows import SparseRows, empty_rows, stack
from scenes.transport.sharing import receiving, share
from scenes.transport.splat import group_by_pixel, response_centres, splat, splat_loose
from scenes.transport.tiles import SIDES, TILE, TiledRows, no_tiles, stack_tiles, tile_grid

_Samples = tuple[Ints32, Floats32, Floats32, Floats32]
_SAMPLE_SETS = 256
_PASS_SAMPLES = 1 << 22
"""Samples traced together: bounds the memory of a pass at a few hundred megabytes."""


class _Rows(NamedTuple):
    """Traced rows of the image."""

    direct: SparseRows
    indirect: TiledRows
    ambient: Floats32
    centres: Floats32


class _Pass:
    """Rows of the image that are traced together: the first of them, and which pixels can see anything."""

    def __init__(self, first: int, seen: Bools) -> None:
        self.first = first
        self.seen = seen
        self.pixels: Ints32 = np.flatnonzero(seen).astype(np.int32)

    def all_starts(self, starts: Ints) -> Ints:
        """Row starts of all pixels of the pass, from those of the pixels that were traced."""
        counts = np.zeros(self.seen.size + 1, np.int64)
        counts[self.pixels + 1] = np.diff(starts)
        return np.cumsum(counts)


class _Paths(NamedTuple):
    """Light found along the paths of one pass: at the first surface, at later ones, and from the surround."""

    direct: Lit
    bounced: list[Lit]
    ambient: Any


def trace(
    mi: Any,
    scene: Any,
    optics: Optics,
    *,
    samples: int = 16,
    bounces: int = 3,
    seed: int = 0,
) -> LightTransport:
    """Trace the light transport between projector and camera.

    Parameters
    ----------
    mi, scene
        The activated vectorised Mitsuba module, and a scene (camera frame, mm) without emitters.
    optics
        The true rig.
    samples
        Per camera pixel; a power of two.
    bounces
        Surface interactions of the longest path; 1 is direct light alone.
    seed
        Of the sampling. The same seed gives the same bits, whatever the number of threads.

    Complexity: O(pixels × samples × bounces) rays; memory O(pixels + one pass).

    """
    view = optics.rig.camera
    sets = mi.Float(sample_sets(sets=_SAMPLE_SETS, samples=samples, seed=seed).ravel())
    seen = may_see(mi, scene, optics)
    rows = min(view.height, max(TILE, _PASS_SAMPLES // (view.width * samples) // TILE * TILE))
    parts = []
    for first in range(0, view.height, rows):
        part = _Pass(first, seen[first : first + rows])
        parts.append(_trace_rows(mi, scene, optics, sets, samples, part, bounces, seed))
    ambient = np.concatenate([part.ambient for part in parts])
    centres = np.concatenate([part.centres for part in parts], axis=1)
    return LightTransport(
        camera_shape=view.shape,
        projector_shape=optics.rig.projector.shape,
        direct=stack([part.direct for part in parts]),
        indirect=stack_tiles([part.indirect for part in parts]),
        ambient=ambient.reshape(view.shape),
        u_px=centres[0].reshape(view.shape),
        v_px=centres[1].reshape(view.shape),
        spread_px=centres[2].reshape(view.shape),
    )


def _trace_rows(
    mi: Any,
    scene: Any,
    optics: Optics,
    sets: Any,
    samples: int,
    part: _Pass,
    bounces: int,
    seed: int,
) -> _Rows:
    width = optics.rig.camera.width
    size = part.pixels.size * samples
    if size == 0:
        return _dark(part.seen.shape)
    index = dr.arange(mi.UInt32, size)
    pixel = dr.gather(mi.UInt32, mi.UInt32(part.pixels), index // samples)
    pixel += dr.opaque(mi.UInt32, part.first * width)
    chosen = mi.sample_tea_32(pixel, mi.UInt32(seed))[0] & (_SAMPLE_SETS - 1)
    place = 2 * (chosen * samples + index % samples)
    column = (pixel % width) + dr.gather(mi.Float, sets, place) - 0.5
    row = (pixel // width) + dr.gather(mi.Float, sets, place + 1) - 0.5
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(mi.sample_tea_32(seed, part.first)[0], size)
    paths = _follow(mi, scene, optics, sampler, column, row, bounces)
    # One kernel for everything; Dr.Jit does not look into named tuples by itself.
    dr.eval(paths.ambient, [list(lit) for lit in (paths.direct, *paths.bounced)])
    return _collect(optics, paths, part, samples)


def _follow(
    mi: Any,
    scene: Any,
    optics: Optics,
    sampler: Any,
    column: Any,
    row: Any,
    bounces: int,
) -> _Paths:
    """Follow one path per sample; the surfaces are sampled by their BSDF, the projector by next events."""
    context = mi.BSDFContext()
    ray = camera_rays(mi, optics, column, row, _lens(mi, optics.camera_aperture_mm, sampler))
    si = scene.ray_intersect(ray)
    active = si.is_valid()
    direct = projected_light(mi, scene, optics, si, _lens(mi, optics.projector_aperture_mm, sampler), active)
    bounced, ambient, throughput = [], mi.Float(0.0), mi.Float(1.0)
    for bounce in range(1, max(bounces, 2)):
        turn, weight = si.bsdf().sample(context, si, sampler.next_1d(active), sampler.next_2d(active), active)
        throughput = throughput * weight[0]
        active &= throughput > 0.0
        ray = si.spawn_ray(si.to_world(turn.wo))
        si = scene.ray_intersect(ray, active)
        ambient += dr.select(active & ~si.is_valid(), throughput, 0.0)
        active &= si.is_valid()
        if bounce < bounces:
            lens = _lens(mi, optics.projector_aperture_mm, sampler)
            lit = projected_light(mi, scene, optics, si, lens, active)
            bounced.append(Lit(lit.u_px, lit.v_px, lit.weight * throughput))
    return _Paths(direct, bounced, ambient)


def _lens(mi: Any, aperture_mm: float, sampler: Any) -> Any:
    """A point on the unit disc, or nothing for a pinhole."""
    return mi.warp.square_to_uniform_disk(sampler.next_2d()) if aperture_mm else None


def _collect(optics: Optics, paths: _Paths, part: _Pass, samples: int) -> _Rows:
    """Sparse rows of one pass."""
    pixels = part.seen.size
    projector, profile = optics.rig.projector.shape, optics.profile
    offsets = np.arange(part.pixels.size + 1, dtype=np.int64) * samples
    u, v, w = (a.numpy() for a in paths.direct)
    w = w * np.float32(1.0 / samples)
    starts, columns, values = splat(u, v, w, offsets, shape=projector, profile=profile)
    direct = SparseRows(part.all_starts(starts), columns, values)
    light = direct.row_sums().reshape(part.seen.shape)
    indirect = _tiled(optics, [_lit_samples(lit, part, samples) for lit in paths.bounced], light)
    ambient = np.zeros(pixels, np.float32)
    ambient[part.pixels] = paths.ambient.numpy().reshape(-1, samples).mean(axis=1)
    centres = np.full((3, pixels), np.nan, np.float32)
    centres[:, part.pixels] = response_centres(u, v, w, offsets)
    return _Rows(direct, indirect, ambient, centres)


def _tiled(optics: Optics, bounced: list[_Samples], light: Floats32) -> TiledRows:
    """Interreflected light of one pass, shared by tiles."""
    receives = receiving(light)
    shared = [share(*samples, direct=light, receives=receives) for samples in bounced]
    levels = []
    for level, side in enumerate(SIDES):
        rows, columns = tile_grid(light.shape, side=side)
        u, v, w, offsets = group_by_pixel([one[level] for one in shared], rows * columns)
        taps = splat_loose(u, v, w, offsets, shape=optics.rig.projector.shape, profile=optics.profile)
        levels.append(SparseRows(*taps))
    return TiledRows(tuple(levels), receives)


def _dark(shape: tuple[int, int]) -> _Rows:
    """Rows where the camera sees nothing."""
    pixels = shape[0] * shape[1]
    nan = np.full((3, pixels), np.nan, np.float32)
    return _Rows(empty_rows(pixels), no_tiles(shape), np.zeros(pixels, np.float32), nan)


def _lit_samples(lit: Lit, part: _Pass, samples: int) -> _Samples:
    """Camera pixel, u, v and weight of the samples that carry light."""
    weight = lit.weight.numpy()
    index = np.flatnonzero(weight)
    u, v = lit.u_px.numpy()[index], lit.v_px.numpy()[index]
    return part.pixels[index // samples], u, v, weight[index] * np.float32(1.0 / samples)
