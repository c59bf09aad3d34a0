"""The first few paths of every pixel: its direct light, and a first look at what is interreflected."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import drjit as dr
import numpy as np

from burrscan.arrays import Bools, Floats32, Ints
from scenes.transport.arrivals import Gathered, gather
from scenes.transport.chance import Chance
from scenes.transport.footprint import sample_sets
from scenes.transport.lenses import direct_samples
from scenes.transport.optics import Optics
from scenes.transport.paths import PASS_SAMPLES, direct_light, first_surface, later_surfaces, on_lens
from scenes.transport.rays import Lit
from scenes.transport.rows import SparseRows
from scenes.transport.splat import response_centres, splat

_PILOT = 1
"""Sets the pilot's random numbers apart from those of a refinement, whose paths are more than one."""
_SAMPLE_SETS = 256
"""Different nets that pixels draw from, a power of two for a mask; too few, and pixels' errors repeat."""


class Pilot(NamedTuple):
    """Some flat camera ``pixels`` (P,) traced.

    ``bounced``: their interreflected light. ``ambient`` (P,): light of a uniform surround.
    """

    pixels: Ints
    bounced: Gathered
    ambient: Floats32


class Direct(NamedTuple):
    """Direct light of some flat camera ``pixels`` (P,).

    ``rows``: where from. ``centres`` (3, P): its :func:`scenes.transport.splat.response_centres`.
    """

    pixels: Ints
    rows: SparseRows
    centres: Floats32


class _Samples(NamedTuple):
    """So many samples ``each`` of some pixels: surfaces seen, places on the projector's lens, and chance."""

    pixels: Ints
    each: int
    si: Any
    lens: Any
    chance: Chance


def pilots(
    mi: Any, scene: Any, optics: Optics, *, seen: Bools, samples: int, bounces: int, seed: int
) -> tuple[list[Pilot], list[Direct]]:
    """Trace ``samples`` paths for each pixel of ``seen`` (h, w), a few million at a time.

    Where a lens blurs, direct light takes more samples than that (:mod:`scenes.transport.lenses`), and is
    traced apart from the paths.

    O(pixels × samples × bounces) rays.
    """
    pixels, first, direct = np.flatnonzero(seen), [], []
    more = direct_samples(mi, scene, optics, least=samples)
    for some in _portions(mi, scene, optics, pixels, samples, seed):
        lit = direct_light(mi, scene, optics, some.si, some.lens) if more == samples else None
        dr.schedule(list(lit or ()))  # in the kernel of the first turn
        first.append(_bounced(mi, scene, optics, some, bounces))
        direct += [_splatted(optics, some, lit)] if lit else []
    if more > samples:
        every = _portions(mi, scene, optics, pixels, more, seed)
        direct += [
            _splatted(optics, some, direct_light(mi, scene, optics, some.si, some.lens)) for some in every
        ]
    return first, direct


def _portions(
    mi: Any, scene: Any, optics: Optics, pixels: Ints, samples: int, seed: int
) -> Iterator[_Samples]:
    """The samples of some pixels after the other, as many as fit."""
    apertures = optics.camera_aperture_mm, optics.projector_aperture_mm
    dimensions = 6 if any(apertures) else 2  # the pixel's two, and two for each lens
    nets = sample_sets(sets=_SAMPLE_SETS, samples=samples, seed=seed, dimensions=dimensions)
    sets, width = mi.Float(nets.ravel()), optics.rig.camera.width
    many = max(PASS_SAMPLES // samples, 1)
    for start in range(0, max(len(pixels), 1), many):
        some = pixels[start : start + many]
        index = dr.arange(mi.UInt32, len(some) * samples)
        pixel = dr.gather(mi.UInt32, mi.UInt32(some.astype(np.uint32)), index // samples)
        chosen = mi.sample_tea_32(pixel, dr.opaque(mi.UInt32, seed))[0] & (_SAMPLE_SETS - 1)
        place = dimensions * (chosen * samples + index % samples)
        at = [dr.gather(mi.Float, sets, place + each) for each in range(dimensions)]
        column, row = mi.Float(pixel % width) + at[0] - 0.5, mi.Float(pixel // width) + at[1] - 0.5
        camera, projector = (
            on_lens(mi, aperture, mi.Point2f(*at[first : first + 2]) if aperture else None)
            for first, aperture in zip((2, 4), apertures, strict=True)
        )
        salt = mi.sample_tea_32(dr.opaque(mi.UInt32, seed), mi.UInt32(_PILOT))[0]
        si = first_surface(mi, scene, optics, column, row, camera)
        yield _Samples(some, samples, si, projector, Chance(pixel * samples + index % samples, salt))


def _bounced(mi: Any, scene: Any, optics: Optics, some: _Samples, bounces: int) -> Pilot:
    count, samples = len(some.pixels), some.each
    bounced = later_surfaces(mi, scene, optics, some.si, some.chance, bounces)
    ambient = np.zeros(count)
    for path, throughput in bounced.left:
        ambient += np.bincount(path.numpy() // samples, weights=throughput.numpy(), minlength=count)
    gathered = gather(bounced.arrivals, samples=np.full(count, samples), learn=True)
    return Pilot(some.pixels, gathered, (ambient / samples).astype(np.float32))


def _splatted(optics: Optics, some: _Samples, lit: Lit) -> Direct:
    u, v, w = (each.numpy() for each in lit)
    w = w * np.float32(1.0 / some.each)
    offsets = np.arange(len(some.pixels) + 1, dtype=np.int64) * some.each
    rows = splat(u, v, w, offsets, shape=optics.rig.projector.shape, profile=optics.profile)
    return Direct(some.pixels, SparseRows(*rows), response_centres(u, v, w, offsets))
