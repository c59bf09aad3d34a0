"""More light paths where the few of the pilot leave the interreflected light too uncertain."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import drjit as dr
import numpy as np

from burrscan.arrays import Bools, Floats, Floats32, Ints
from scenes.transport.arrivals import PART_BITS, Finds, Gathered, gather
from scenes.transport.chance import Chance
from scenes.transport.guide import Guide, guide_of
from scenes.transport.neighbours import WINDOW, summed
from scenes.transport.optics import Optics
from scenes.transport.paths import (
    CAMERA_LENS,
    PASS_SAMPLES,
    Arrival,
    choice_kind,
    first_surface,
    later_surfaces,
    on_lens,
)
from scenes.transport.sobol import DIMENSIONS, point, reversed_points
from scenes.transport.turn import Guided

LEAST_SAMPLES = 32
"""Of a round. With 64 the guides of the first are hardly better, and the scene ``paper`` takes a sixth
longer."""
_PATHS = 0x5EED
"""Sets the paths' random numbers apart from the scrambling of their nets."""
_TURNS = 2
"""Whose directions are points of the net; the axes after them are the place in the pixel."""
_MOST_PATHS = 1 << 14
"""Numbers set apart for a pixel's paths. Pixels 2^18 apart share those of lenses, blur and lobes, for words
have 32 bits, but no direction of the first two turns: those are Sobol points."""
_CHOICE_BITS = 1, 2 + PART_BITS
"""Of a point's number in its net, counted from the highest: that which says which way a turn goes. Those
between are the part that the point is of."""
_PATHS_A_HIT = 8
"""Paths that start at one place of the pixel: where in the pixel they start is less than a hundredth of the
variance of interreflected light, and finding the surface there for each took a fifth of the time."""
_RATE = 0.6
"""The error of interreflected light falls with paths^-0.6 (polished, ground, turned; 0.5 is chance). 0.52 and
0.7 give the same errors for the same paths."""
_DIM = 1e-3
"""Share of the bright pixels' light below which the error allowed grows as the root of light falls, as that
of photons in a camera does: a pixel of half this share may be off by 1.4 times as much."""
_DARK = 3e-4
"""Share of the bright pixels' light below which light counts as this much: no exposure shows both."""
_STRIPES_PX = 24.0
"""Period of the stripes that errors are weighed by, projector columns: between the finest (6.5) and the
coarsest that a scan of this package shows."""
_LEAST_MODULATED = 0.1
"""Share of a pixel's light below which what goes with stripes counts as this much: no decoder believes it."""


def stripe_table(columns: int) -> Floats32:
    """(columns, 3): white, and cosine and sine of the stripes that errors are weighed by."""
    angle = 2.0 * np.pi * np.arange(columns) / _STRIPES_PX
    return np.stack([np.ones(columns), np.cos(angle), np.sin(angle)], axis=1).astype(np.float32)


def needed_samples(
    variance: Floats,
    *,
    direct: Floats,
    indirect: Floats,
    refined: Ints,
    pilot: int,
    seen: Bools,
    error: float,
    most: int,
    paths: int,
) -> Ints:
    """How many more paths each pixel needs, (h, w); 0 where those it had suffice.

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
        (3, h, w) light under white, and under the cosine and the sine of :func:`stripe_table`; the direct is
        known well from the start.
    refined
        (h, w) paths of refinements that each pixel had.
    pilot
        Paths that each had of the pilot; they do not count once there are others.
    seen
        (h, w) pixels that were traced.
    error
        Standard error to be reached, relative to the geometric mean of the pixel's whole light and what of it
        goes with stripes: where light of many columns mixes, as in a groove, an error shifts stripes far.
    most
        Paths that a round gives no pixel more of, a power of two: half the points would be worse nets.
    paths
        Of all pixels together. Where they need more, those that need most get less.

    """
    need = np.zeros(seen.shape, np.int64)
    traced = np.flatnonzero(seen)
    if not traced.size:
        return need
    single, had = variance.flat[traced], refined.flat[traced]
    count = np.maximum(summed(np.ones(seen.shape), seen, itself=False).flat[traced], 1.0)
    limit = error * _tolerable(direct, indirect, seen)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.nan_to_num(np.sqrt(summed(variance, seen, itself=False).flat[traced] / count) / limit)
        alone = np.nan_to_num(np.sqrt(single / WINDOW**2) / limit)
    ratio_pilot = np.where((had == 0) & (pilot < LEAST_SAMPLES), np.maximum(ratio, alone), ratio)
    uncertain = ratio_pilot > np.sqrt(pilot)  # whose paths are independent
    ratio, had = ratio[uncertain], had[uncertain]
    wanted = np.clip(np.maximum(ratio, 1.0) ** (1.0 / _RATE), LEAST_SAMPLES, most)
    more = np.minimum(_rounded_up(np.maximum(wanted - had, LEAST_SAMPLES)), most)
    more = np.where(wanted > np.maximum(had, pilot), more, 0)
    while more.sum() > paths and most > LEAST_SAMPLES:
        most //= 2
        more = np.minimum(more, most)
    need.flat[traced[uncertain]] = more
    return need


def most_of_a_path(direct: Floats, indirect: Floats, *, seen: Bools, error: float) -> Floats:
    """(h, w) light that no single path may give a pixel, infinite where no error is asked for.

    What meets a glint once in many thousand paths makes one pixel a hundred times too bright, and is missing
    in all others. A path counts for what is still as large as the error aimed at when it is spread over the
    25 pixels around; the rest is lost. Parameters as of :func:`needed_samples`.
    """
    most = np.full(seen.shape, np.inf)
    if np.isfinite(error) and seen.any():
        most[seen] = WINDOW**2 * error * _tolerable(direct, indirect, seen)
    return most


def _tolerable(direct: Floats, indirect: Floats, seen: Bools) -> Floats:
    """Of each pixel that was traced, the light that errors of its interreflected light are relative to."""
    count = np.maximum(summed(np.ones(seen.shape), seen, itself=False)[seen], 1.0)
    light = direct[:, seen] + np.stack([(summed(one, seen) - one)[seen] for one in indirect]) / count
    bright = np.percentile(light[0], 99.0)
    whole = np.maximum(light[0], _DARK * bright)
    modulated = np.clip(np.hypot(light[1], light[2]), _LEAST_MODULATED * whole, whole)
    return np.asarray(np.sqrt(np.maximum(whole, _DIM * bright) * modulated))


def _rounded_up(wanted: Floats) -> Ints:
    """The next power of two: one net. Two or three of half the size leave 8 % more error."""
    return np.asarray(np.exp2(np.ceil(np.log2(wanted)))).astype(np.int64)


def refine(
    mi: Any,
    scene: Any,
    optics: Optics,
    *,
    pixels: Ints,
    samples: Ints,
    bounces: int,
    seed: int,
    finds: list[Finds],
    learn: bool,
) -> Iterator[tuple[Ints, Gathered]]:
    """Trace paths for some flat camera pixels, a few million at a time.

    ``samples`` (P,) says how many for each, as :func:`needed_samples` does; ``finds`` of earlier paths where
    light is; ``learn`` that there is a round after this one. O(paths × bounces) rays.
    """
    table = mi.UInt32(reversed_points(int(samples.max())))
    passes = np.cumsum(samples) // PASS_SAMPLES
    for number in np.unique(passes):
        mine = passes == number
        some = pixels[mine]
        guides = [guide_of(some, turn, optics.rig.camera.shape) for turn in finds]
        paths = _Refined(mi, table, some, samples[mine], guides, seed, learn=learn)
        yield some, gather(paths.traced(scene, optics, bounces), samples=samples[mine], learn=learn)


class _Refined:
    """Paths of a refinement: ``samples`` for each of some pixels, one pixel's after the other."""

    def __init__(
        self,
        mi: Any,
        table: Any,
        pixels: Ints,
        samples: Ints,
        guides: Sequence[Guide],
        seed: int,
        *,
        learn: bool,
    ) -> None:
        def words(numbers: Ints | Floats) -> Any:
            return mi.UInt32(numbers.astype(np.uint32))

        self._mi, self._table, self._paths = mi, table, int(samples.sum())
        # shifts, for a division by what a lane past the end reads, 0, ends the process
        self._pixel, self._bits = words(pixels), words(np.log2(samples))
        self._first = words(np.cumsum(samples) - samples)
        self._slot = words(np.repeat(np.arange(len(pixels)), samples))
        # no round may use another's numbers: its guides depend on what those found
        self._seed = mi.sample_tea_32(dr.opaque(mi.UInt32, seed), dr.opaque(mi.UInt32, int(learn)))[0]
        self._salt = mi.sample_tea_32(self._seed, mi.UInt32(_PATHS))[0]
        self._guides = [
            (
                words(one.tiles),
                mi.Bool(one.known),
                *(mi.Float(table.ravel()) for table in (one.frames, one.across, one.along)),
            )
            for one in guides
        ]

    def traced(self, scene: Any, optics: Optics, bounces: int) -> list[Arrival]:
        """The light that the paths bring."""
        mi, width = self._mi, optics.rig.camera.width
        leading = dr.arange(mi.UInt32, self._paths // _PATHS_A_HIT) * _PATHS_A_HIT
        pixel = self._of(self._pixel, leading)
        # of a net's points the first ones, so that they are a net, too
        column, row = self._point(leading, range(2 * _TURNS, DIMENSIONS), share=_PATHS_A_HIT)
        place = mi.Float(pixel % width) + column - 0.5, mi.Float(pixel // width) + row - 0.5
        lens = on_lens(mi, optics.camera_aperture_mm, self._chance(leading).two(mi, CAMERA_LENS))
        si = first_surface(mi, scene, optics, *place, lens, paths_each=_PATHS_A_HIT)
        every = self._chance(dr.arange(mi.UInt32, self._paths))
        return later_surfaces(mi, scene, optics, si, every, bounces, paths=self).arrivals

    def uniform(self, turn: int, path: Any) -> tuple[Any, Any] | None:
        """See :class:`scenes.transport.paths.Paths`.

        One half of a net's points goes one way at the first turn, the other half the other way, and of each
        part of a half at the second turn: either is a net of its own, of directions in the best two axes.
        """
        if turn >= _TURNS:
            return None
        bit = self._of(self._bits, path) - _CHOICE_BITS[turn]
        half = (self._within(path) >> bit) & 1
        choice = 0.5 * (self._mi.Float(half) + self._chance(path).one(self._mi, choice_kind(turn)))
        return choice, self._mi.Point2f(*self._point(path, range(2 * turn, 2 * turn + 2)))

    def guided(self, turn: int, path: Any) -> Guided | None:
        """See :class:`scenes.transport.paths.Paths`."""
        if turn >= len(self._guides):
            return None
        tiles, known, frames, across, along = self._guides[turn]
        number = self._of(tiles, path)
        middle, side = (dr.gather(self._mi.Vector3f, frames, 2 * number + k) for k in range(2))
        return Guided(dr.gather(self._mi.Bool, known, number), middle, side, number, across, along)

    def _of(self, table: Any, path: Any) -> Any:
        """What a table of the pixels says for paths."""
        return dr.gather(self._mi.UInt32, table, dr.gather(self._mi.UInt32, self._slot, path))

    def _within(self, path: Any) -> Any:
        """Which of its pixel's paths each is."""
        return path - self._of(self._first, path)

    def _point(self, path: Any, axes: range, *, share: int = 1) -> list[Any]:
        """Coordinates of the Sobol points of paths, ``share`` of which in a row share one."""
        key = self._mi.sample_tea_32(self._of(self._pixel, path), self._seed)[0]
        return point(self._mi, self._table, self._within(path) // share, key, axes)

    def _chance(self, path: Any) -> Chance:
        return Chance(self._of(self._pixel, path) * _MOST_PATHS + self._within(path), self._salt)
