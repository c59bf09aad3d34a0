"""The first few paths of every pixel: its direct light, and a first look at what is interreflected."""

from __future__ import annotations

from typing import Any, NamedTuple

import drjit as dr
import numpy as np

from burrscan.arrays import Bools, Floats32, Ints
from scenes.transport.arrivals import Gathered, gather
from scenes.transport.chance import Chance
from scenes.transport.footprint import sample_sets
from scenes.transport.optics import Optics
from scenes.transport.paths import PASS_SAMPLES, direct_light, first_surface, later_surfaces
from scenes.transport.rows import SparseRows
from scenes.transport.splat import response_centres, splat

_PILOT = 1
"""Sets the pilot's random numbers apart from those of a refinement, whose paths are more than one."""
_SAMPLE_SETS = 256
"""Different nets that pixels draw from, a power of two for a mask; too few, and pixels' errors repeat."""


class Pilot(NamedTuple):
    """Some flat camera ``pixels`` (P,) traced.

    ``direct``: their direct light. ``bounced``: their interreflected light. ``ambient`` (P,): light of a
    uniform surround. ``centres`` (3, P): :func:`scenes.transport.splat.response_centres` of the direct light.
    """

    pixels: Ints
    direct: SparseRows
    bounced: Gathered
    ambient: Floats32
    centres: Floats32


def pilots(
    mi: Any, scene: Any, optics: Optics, *, seen: Bools, samples: int, bounces: int, seed: int
) -> list[Pilot]:
    """Trace ``samples`` paths for each pixel of ``seen`` (h, w), a few million at a time.

    O(pixels × samples × bounces) rays.
    """
    sets = mi.Float(sample_sets(sets=_SAMPLE_SETS, samples=samples, seed=seed).ravel())
    pixels, each = np.flatnonzero(seen), max(PASS_SAMPLES // samples, 1)
    starts = range(0, max(len(pixels), 1), each)
    return [
        _traced(mi, scene, optics, sets, pixels[first : first + each], samples, bounces, seed)
        for first in starts
    ]


def _traced(
    mi: Any, scene: Any, optics: Optics, sets: Any, pixels: Ints, samples: int, bounces: int, seed: int
) -> Pilot:
    width, size = optics.rig.camera.width, len(pixels) * samples
    index = dr.arange(mi.UInt32, size)
    pixel = dr.gather(mi.UInt32, mi.UInt32(pixels.astype(np.uint32)), index // samples)
    chosen = mi.sample_tea_32(pixel, dr.opaque(mi.UInt32, seed))[0] & (_SAMPLE_SETS - 1)
    place = 2 * (chosen * samples + index % samples)
    column = mi.Float(pixel % width) + dr.gather(mi.Float, sets, place) - 0.5
    row = mi.Float(pixel // width) + dr.gather(mi.Float, sets, place + 1) - 0.5
    number = pixel * samples + index % samples
    chance = Chance(number, mi.sample_tea_32(dr.opaque(mi.UInt32, seed), mi.UInt32(_PILOT))[0])
    si = first_surface(mi, scene, optics, column, row, chance)
    direct = direct_light(mi, scene, optics, si, chance)
    dr.schedule(list(direct))  # in the kernel of the first turn
    bounced = later_surfaces(mi, scene, optics, si, chance, bounces)
    u, v, w = (a.numpy() for a in direct)
    w = w * np.float32(1.0 / samples)
    offsets = np.arange(len(pixels) + 1, dtype=np.int64) * samples
    ambient = np.zeros(len(pixels))
    for path, throughput in bounced.left:
        ambient += np.bincount(path.numpy() // samples, weights=throughput.numpy(), minlength=len(pixels))
    return Pilot(
        pixels=pixels,
        direct=SparseRows(*splat(u, v, w, offsets, shape=optics.rig.projector.shape, profile=optics.profile)),
        bounced=gather(bounced.arrivals, samples=np.full(len(pixels), samples), learn=True),
        ambient=(ambient / samples).astype(np.float32),
        centres=response_centres(u, v, w, offsets),
    )
