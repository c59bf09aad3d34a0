"""Where the light of a pixel comes from: places that its neighbours' paths found, and paths that aim at them.

On polished metal a path that follows the reflection at the first surface rarely meets the narrow highlight on
the second one, and carries very much light when it does. So half of the paths of a refined pixel aim at places
near which its neighbourhood's earlier paths found light, the other half follow the reflection; each is weighted
by the density of both (one-sample balance heuristic, Veach & Guibas 1995), which keeps the mean exact wherever
the aim is. Learning where light comes from out of earlier paths is path guiding (Jensen 1995; Vorba et al. 2014).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import drjit as dr
import numba as nb
import numpy as np

from burrscan.arrays import Bools, Floats32, Ints, Ints32
from scenes.transport.arrivals import Gathered
from scenes.transport.rows import SparseRows, scattered

TARGETS = 8
"""Places that a pixel aims at. More cost time in every path; 8 cover a highlight and its mirror image."""
_REACH = 2
"""Paths of 5 × 5 pixels are learnt from."""
_KAPPA = 1.0 / 0.25**2
"""Concentration of the directions about a place (von Mises & Fisher), 0.25 rad: eight places must cover what few
paths found. From 0.2 to 0.45 rad the error hardly changes (polished, ground, turned, brass); 0.1 doubles it."""
_SHARE = 0.5
"""Of the paths that aim; the rest bounds the loss of a bad aim to a doubled variance."""


class Finds(NamedTuple):
    """Paths that carry light, by camera pixel.

    ``light``: of each, a row per flat pixel; its columns number the rows of ``points_mm`` (n, 3), the second
    surface that each met, camera frame.
    """

    light: SparseRows
    points_mm: Floats32


class Aim(NamedTuple):
    """What some pixels aim at: ``points_mm`` (P, TARGETS, 3), and whether they know of any place (P,)."""

    points_mm: Floats32
    known: Bools


def found(parts: list[tuple[Ints, Gathered]], count: int) -> Finds:
    """Paths with light of ``count`` camera pixels; of several parts for one pixel the last holds."""
    firsts = np.cumsum([0, *(len(one.points_mm) for _, one in parts)])
    lit = [
        (pixels, replace(one.lit, columns=one.lit.columns + np.int32(first)))
        for (pixels, one), first in zip(parts, firsts[:-1].tolist(), strict=True)
    ]
    return Finds(scattered(lit, count), np.concatenate([one.points_mm for _, one in parts]))


def aim_of(pixels: Ints, finds: Finds, shape: tuple[int, int]) -> Aim:
    """Choose places for flat camera pixels, drawn by light from their neighbourhood's finds.

    Systematic resampling: a place is chosen as often as its share of the light says. O(pixels × finds around).
    """
    rows = finds.light
    return Aim(*_resampled(pixels, rows.starts, rows.columns, rows.values, finds.points_mm, *shape))


def turned(mi: Any, si: Any, aim: Any, known: Any, choice: Any, direction: Any) -> tuple[Any, Any]:
    """First direction of a path, in the world, and its throughput.

    Parameters
    ----------
    mi
        The activated Mitsuba module.
    si
        The first surface.
    aim
        :data:`TARGETS` points.
    known
        Whether they are to be used.
    choice, direction
        Random numbers: which way to choose the direction (1D), and the direction (2D).

    """
    context, active = mi.BSDFContext(), si.is_valid()
    share = dr.select(known, mi.Float(_SHARE), 0.0)
    aims = choice < share
    rest = dr.select(aims, choice / dr.maximum(share, 1e-6), (choice - share) / (1.0 - share))
    chosen, _ = si.bsdf().sample(context, si, rest, direction, active & ~aims)
    place = dr.minimum(mi.UInt32(rest * TARGETS), TARGETS - 1)
    middle = mi.Vector3f(0.0, 0.0, 1.0)
    towards = [dr.normalize(point - si.p) for point in aim]
    for k, one in enumerate(towards):
        middle = dr.select(place == k, one, middle)
    wo = dr.select(aims, mi.Frame3f(middle).to_world(_about(mi, direction)), si.to_world(chosen.wo))
    light, density = si.bsdf().eval_pdf(context, si, si.to_local(wo), active)
    aimed = mi.Float(0.0)
    for one in towards:
        aimed += dr.exp(_KAPPA * (dr.dot(one, wo) - 1.0))
    aimed *= _KAPPA / (2.0 * np.pi * TARGETS)  # 1 - exp(-2 kappa) is 1 to 1e-13
    mixed = share * dr.select(known, aimed, 0.0) + (1.0 - share) * density
    return wo, dr.select(active & (mixed > 0.0), light[0] / mixed, 0.0)


def _about(mi: Any, uniform: Any) -> Any:
    """A direction about +z, by von Mises and Fisher."""
    cosine = dr.clip(1.0 + dr.log(dr.maximum(1.0 - uniform.x, 1e-12)) / _KAPPA, -1.0, 1.0)
    sine = dr.sqrt(dr.maximum(0.0, 1.0 - cosine * cosine))
    s, c = dr.sincos(2.0 * np.pi * uniform.y)
    return mi.Vector3f(sine * c, sine * s, cosine)


@nb.njit(cache=True, parallel=True)
def _resampled(
    pixels: Ints, starts: Ints, paths: Ints32, light: Floats32, points: Floats32, height: int, width: int
) -> tuple[Floats32, Bools]:
    chosen = np.zeros((pixels.size, TARGETS, 3), np.float32)
    known = np.zeros(pixels.size, np.bool_)
    for p in nb.prange(pixels.size):
        i, j = pixels[p] // width, pixels[p] % width
        total = 0.0
        for y in range(max(i - _REACH, 0), min(i + _REACH + 1, height)):
            for x in range(max(j - _REACH, 0), min(j + _REACH + 1, width)):
                for k in range(starts[y * width + x], starts[y * width + x + 1]):
                    total += light[k]
        if total <= 0.0:
            continue
        known[p] = True
        passed, n = 0.0, 0
        for y in range(max(i - _REACH, 0), min(i + _REACH + 1, height)):
            for x in range(max(j - _REACH, 0), min(j + _REACH + 1, width)):
                for k in range(starts[y * width + x], starts[y * width + x + 1]):
                    passed += light[k]
                    while n < TARGETS and passed >= (n + 0.5) / TARGETS * total:
                        chosen[p, n] = points[paths[k]]
                        n += 1
        while 0 < n < TARGETS:  # rounding left the last place open
            chosen[p, n] = chosen[p, n - 1]
            n += 1
    return chosen, known
