"""Where interreflected light comes from, found from its other end: rays of the projector that reach the part.

What a narrow lobe mirrors onto a dark flank, paths from the camera meet once in ten thousand: most pixels are
then too dark, and a few a hundred times too bright. Rays from the projector follow the lobe, and meet what it
shines on. They carry no light into the picture. They only tell the paths of a refinement where to look
(importance from photons, Jensen 1995), and these weigh what they find by the density of all ways.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import numpy as np

from burrscan.arrays import Floats32, Ints
from scenes.transport.arrivals import LEARNT_TURNS, Finds
from scenes.transport.chance import Chance
from scenes.transport.optics import Optics
from scenes.transport.paths import surface_at
from scenes.transport.rays import projector_rays, seen_light
from scenes.transport.rows import SparseRows

_GRID = 512, 512
"""Rows and columns of rays of the projector. With four times as many a dark flank errs by a tenth less, with
sixty-four times by no less than that."""
_SALT = 0xF107
"""Sets their random numbers apart from those of paths."""
_AS_PATHS = 8.0
"""Paths of a pixel whose finds theirs weigh as much as, a quarter of a first refinement's. With 2 to 32
errors are the same; with 32 guides trust them too much: the turned zoom is too dark, and too sure of it."""
_NUMBERS_A_TURN = 3
"""Kinds of random numbers of a reflection, after two of the projector's pixel."""


def photon_finds(mi: Any, scene: Any, optics: Optics, *, seed: int) -> list[Finds]:
    """Per turn of a camera's path, what rays of the projector find, by flat camera pixel. O(rays)."""
    rows, columns = _GRID
    view, projector = optics.rig.camera, optics.rig.projector
    salt = mi.sample_tea_32(dr.opaque(mi.UInt32, seed), mi.UInt32(_SALT))[0]
    number = dr.arange(mi.UInt32, rows * columns)
    chance = Chance(number, salt)
    within = chance.two(mi, 0)
    column = (mi.Float(number % columns) + within.x) * (projector.width / columns) - 0.5
    row = (mi.Float(number // columns) + within.y) * (projector.height / rows) - 0.5
    ray = projector_rays(mi, optics, column, row)
    # all pixels carry the same flux, see projected_light
    pixel_flux = np.pi * optics.standoff_mm**2 / (projector.fx * projector.fy)
    flux = mi.Float(pixel_flux * projector.width * projector.height / (rows * columns))
    si, went = scene.ray_intersect(ray), list[Any]()
    turns: list[list[tuple[Floats32, Ints, Floats32]]] = [[] for _ in range(LEARNT_TURNS)]
    for turn in range(LEARNT_TURNS):
        kind = 2 + turn * _NUMBERS_A_TURN
        context, alive = mi.BSDFContext(), si.is_valid()
        chosen, weight = si.bsdf().sample(context, si, chance.one(mi, kind), chance.two(mi, kind + 1), alive)
        flux = dr.select(alive, flux * weight[0], 0.0)
        ray = si.spawn_ray(si.to_world(chosen.wo))
        hit = scene.ray_intersect_preliminary(ray, active=flux > 0.0)
        dr.eval(ray.o, ray.d, hit, flux)
        kept: Any = dr.compress(hit.is_valid())
        if dr.width(kept) == 0:
            break
        flux, chance = dr.gather(mi.Float, flux, kept), chance.of(mi, kept)
        went = [dr.gather(mi.Vector3f, one, kept) for one in (-ray.d, *went)]
        si = surface_at(mi, ray, hit, kept)
        pixel, light = seen_light(mi, scene, optics, si)
        light *= flux * _AS_PATHS
        dr.eval(pixel, light, went, flux, si)
        some: Any = dr.compress(light > 0.0)
        values = dr.gather(mi.Float, light, some).numpy(), dr.gather(mi.UInt32, pixel, some).numpy()
        for found, one in zip(turns, went, strict=False):
            found.append((*values, dr.gather(mi.Vector3f, one, some).numpy().T))
    return [_by_pixel(parts, view.width * view.height) for parts in turns]


def _by_pixel(parts: list[tuple[Floats32, Ints, Floats32]], count: int) -> Finds:
    none = (np.zeros(0, np.float32), np.zeros(0, np.uint32), np.zeros((0, 3), np.float32))
    light, pixel, directions = (np.concatenate(one) for one in zip(none, *parts, strict=True))
    order = np.argsort(pixel, kind="stable")
    starts = np.searchsorted(pixel[order], np.arange(count + 1)).astype(np.int64)
    return Finds(SparseRows(starts, np.arange(len(order), dtype=np.int32), light[order]), directions[order])
