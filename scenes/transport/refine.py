"""More light paths where the few of the pilot leave the interreflected light too uncertain."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import drjit as dr
import numpy as np

from burrscan.arrays import Bools, Floats, Ints
from scenes.transport.aim import Aim, aim_of
from scenes.transport.arrivals import REPLICATES, Finds, Gathered, gather
from scenes.transport.chance import Chance
from scenes.transport.neighbours import WINDOW, summed
from scenes.transport.optics import Optics
from scenes.transport.paths import PASS_SAMPLES, first_surface, later_surfaces
from scenes.transport.sobol import point, reversed_table
from scenes.transport.turn import TARGETS, Target

LEAST_SAMPLES = 64
"""Fewer than 16 points a replicate are no net worth the name."""
_RATE = 0.6
"""The error of interreflected light falls with paths^-0.6 (polished, ground, turned; 0.5 is chance)."""
_PILOT_RATIO = 4.0
"""Scatter of single paths, in errors aimed at, that the pilot's 16 independent paths bring below it."""
_DIM = 1e-3
"""Share of the bright pixels' light below which the error allowed grows as the root of light falls, as that
of photons in a camera does: a pixel of half this share may be off by 1.4 times as much."""
_DARK = 3e-4
"""Share of the bright pixels' light below which light counts as this much: no exposure shows both."""


def needed_samples(
    variance: Floats,
    *,
    direct: Floats,
    indirect: Floats,
    spent: Ints,
    seen: Bools,
    error: float,
    most: int,
) -> Ints:
    """How many paths each pixel needs, (h, w); 0 where those it had suffice.

    How much interreflected light a pixel has, and how much that varies, is read off its neighbours: a pixel
    that was dark by chance would otherwise be left dark, and one that was bright refined, and the mean of all
    would be biased. Only whether a pixel keeps its pilot's paths is asked of itself too: one of 16 paths that
    found what 400 around it did not would shine alone, where the light is spread over all 25 pixels. They are
    traced anew together, which keeps that light; what is lost are events so rare that neither a pixel nor its
    neighbours met one, below the error aimed at.

    Parameters
    ----------
    variance
        (h, w) of the interreflected light of one path.
    direct, indirect
        (h, w) light; the direct is known well from the start.
    spent
        (h, w) paths that each pixel had.
    seen
        (h, w) pixels that were traced.
    error
        Standard error to be reached, relative to the pixel's whole light.
    most
        Paths that no pixel exceeds, a power of two.

    """
    light = direct + around(indirect, seen)
    bright = np.percentile(light[seen], 99.0) if seen.any() else 0.0
    whole = np.maximum(light, _DARK * bright)
    limit = error * np.sqrt(whole * np.maximum(whole, _DIM * bright))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.nan_to_num(np.sqrt(around(variance, seen)) / limit)
        alone = np.nan_to_num(np.sqrt(variance / WINDOW**2) / limit)
    wanted = np.exp2(np.ceil(np.log2(np.maximum(ratio, 1.0)) / _RATE)).astype(np.int64)
    wanted = np.clip(wanted, LEAST_SAMPLES, most)
    uncertain = np.where(spent < LEAST_SAMPLES, np.maximum(ratio, alone), ratio) > _PILOT_RATIO
    return np.asarray(np.where(seen & uncertain & (wanted > spent), wanted, 0))


def around(values: Floats, seen: Bools) -> Floats:
    """Mean over each pixel's neighbours that were traced, without itself; 0 where there are none."""
    total, count = summed(values, seen, itself=False), summed(np.ones(seen.shape), seen, itself=False)
    return np.asarray(total / np.maximum(count, 1.0))


def refine(
    mi: Any,
    scene: Any,
    optics: Optics,
    *,
    pixels: Ints,
    samples: int,
    bounces: int,
    seed: int,
    finds: list[Finds],
    learn: bool,
) -> Iterator[tuple[Ints, Gathered]]:
    """Trace ``samples`` paths for each of some flat camera pixels, a few million at a time.

    ``finds`` of earlier paths say where to aim; ``learn`` says that there is a round after this one. O(pixels × samples × bounces) rays.
    """
    table = mi.UInt32(reversed_table(samples // REPLICATES))
    each = max(PASS_SAMPLES // samples, 1)
    for first in range(0, len(pixels), each):
        some = pixels[first : first + each]
        aims = [aim_of(some, turn, optics.rig.camera.shape) for turn in finds]
        yield some, _traced(mi, scene, optics, table, some, aims, samples, bounces, seed, learn)


def _traced(
    mi: Any,
    scene: Any,
    optics: Optics,
    table: Any,
    pixels: Ints,
    aims: list[Aim],
    samples: int,
    bounces: int,
    seed: int,
    learn: bool,
) -> Gathered:
    size, width = len(pixels) * samples, optics.rig.camera.width
    count, part = dr.opaque(mi.UInt32, samples), dr.opaque(mi.UInt32, samples // REPLICATES)
    index = dr.arange(mi.UInt32, size)
    slot, within = index // count, index % count
    pixel = dr.gather(mi.UInt32, mi.UInt32(pixels.astype(np.uint32)), slot)
    key = mi.sample_tea_32(pixel, dr.opaque(mi.UInt32, seed) * REPLICATES + within // part)[0]
    column, row, choice, across, up = point(mi, table, within % part, key)
    number = pixel * count + within
    chance = Chance(number, mi.sample_tea_32(dr.opaque(mi.UInt32, seed), count)[1])
    place = mi.Float(pixel % width) + column - 0.5, mi.Float(pixel // width) + row - 0.5
    si = first_surface(mi, scene, optics, *place, chance)
    places = [(mi.Float(aim.points_mm.ravel()), mi.Bool(aim.known)) for aim in aims]

    def aim(turn: int, path: Any) -> Target | None:
        return _target(mi, *places[turn], path // count) if turn < len(places) else None

    first = choice, mi.Point2f(across, up)
    bounced = later_surfaces(mi, scene, optics, si, chance, bounces, first=first, aim=aim)
    return gather(bounced.arrivals, samples=samples, paths=size, replicates=REPLICATES, learn=learn)


def _target(mi: Any, places: Any, known: Any, slot: Any) -> Target:
    """Each path's targets, those of its pixel."""
    points = [dr.gather(mi.Point3f, places, slot * TARGETS + k) for k in range(TARGETS)]
    return Target(points, dr.gather(mi.Bool, known, slot))
