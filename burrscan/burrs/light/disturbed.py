"""Places where both the brightness and the depth are not the surface's: something stands, or is missing.

A stain, a scratch or chatter changes the light alone: the depth there is the surface's. Noise and edges
change the depth alone. A burr changes both: its flanks mirror, it hides what is behind it and casts a shadow.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from burrscan.arrays import Bools, Floats
from burrscan.burrs.light.aside import MOST, aside, stand
from burrscan.burrs.light.flat import depth_of_a_pixel_mm, wanders_flat
from burrscan.burrs.light.lines import lines
from burrscan.burrs.light.lobe import excess_of_lobe
from burrscan.burrs.light.medians import column_medians
from burrscan.burrs.light.noisy import depths_are_noise
from burrscan.burrs.light.row_sigma import cell_sigma
from burrscan.burrs.light.side import Looks, Told, tilts_deg, told_of
from burrscan.burrs.light.unrolled import Unrolled, unrolled
from burrscan.generatrix import deviation_mm
from burrscan.inspection import Axis, Generatrix
from burrscan.sight import Sight

_LIGHT_Z = 4.0
"""Standard deviations by which the light is off."""
_LEAST_CONTRAST = 0.12
"""Least excess of the logarithm of the light: what finishes vary by from place to place."""
_LONE_CONTRAST, _LONE_EVIDENCE = 0.5, 4.0
"""Least median excess of a place with hardly any depth, where light alone must tell: a factor 1.6; and that
times the root of its cells. Of 180 wheels two had a call below it, holes of 32 and 35 cells in the dark
with 3.4 and 3.7; a curl had 10."""
_DEPTH_Z = 6.0
"""Robust standard deviations, of cells looked at alike, by which the depth is off: beyond what noise shows on
100,000 cells, whose tails are heavier than normal ones. It hardly matters: of 224 burrs in 268 adaptive scans
217 are found with 6 and 215 with 5, beside 12 and 13 false calls."""
_LEAST_SCATTER = 1e-9
"""Of the depth, mm, and of the logarithm of the light; less is the arithmetic's."""
_LEAST_CELLS = 15
"""Cells of a place; fewer are a spot."""
_LEAST_ROWS = 5
"""Rows that a place spans: what runs along a single parallel is an edge of the part."""
_LEAST_FILL = 1.0
"""Disturbed cells of each row that a place spans, on average."""
_RARE = 0.05
"""A place is none where so large a share of its parallels is like it all the way round: that is the part."""
_MEASURABLE = 0.5
"""Nothing is missed where light as strong as predicted was measured at a smaller share of the surface;
the holes of large burrs are among the rest."""
_LEVEL = 0.4
"""Light is as strong within this of its logarithm, a factor 1.5."""
_HIDES = 2.0
"""Cells above the surface that one unmeasured cell speaks for: what stands up hides what is behind it and
shades it, the walls of a nick are seen."""
_ALL_ONE_SIDE = 3.0
"""What cells that are all above, or all below, are worth, as a difference of misfits: a likelihood ratio of
1.7 standard deviations. Of 137 rendered places, used to choose it, 2 are told wrong with 2, 3 with 3
or 4, 4 with 6; cells that decide alone whatever the model does not clearly tell, as they did, 5."""
_MOST_TOLD = MOST
"""What the model tells counts at most as much as :mod:`aside` does: it knows triangles, and burrs curl over.
Beyond it seldom matters: of 338 rendered places it turns the side of three."""
_GRAZED = 0.38
"""Cosine, 68 degrees, from which a place is grazed. Of places without a burr by its depth on 184 rendered
wheels 13 of 46 steeper ones were burrs, most of them on one wheel; of flatter ones three quarters."""
_BLIND, _PLAIN = 0.5, 2.0
"""The same cosine, 60 degrees, of a place most of which has no depth, unless its light is off by a factor 7:
what is looked at flatly is lost for other reasons, too. On rendered wheels such places of 0.38 to 0.5 were
burrs once and six times none; where depth was measured 18 of 21 were burrs."""
_GRADUAL = 1.0 / 3.0
"""Largest change of the excess of light from one cell to the next, over its largest, below which a place as
wide as the widest burr is a glint of light that bounced in a corner. Of 185 places on rendered burrs all such
have 0.43 and more, two glints in grooves 0.26 and 0.29."""
_BESIDE_CELLS = 2
"""What is looked at beyond a place: a flank may be the border of what is off."""
HIGH = 0.8
"""Share of a place's depths below what stands for its height: the highest of them are noise."""


@dataclass(frozen=True)
class Place:
    """One disturbed place.

    Parameters
    ----------
    cells
        (rows, columns) of the unrolled surface.
    above, below, unmeasured
        Cells whose depth lies outside, inside, and that have none.
    contrast
        Median size of the excess of the logarithm of the light.
    crest_mm, floor_mm
        What a fifth of the measured depths exceed, outside and inside; NaN where nothing was measured.
    told
        What ridges and nicks of many sizes make of what is seen; None where they cannot be laid beside it.
    aside
        What the order of high and low says from aside, see :mod:`burrscan.burrs.light.aside`.
    lit
        How much it counts that the projector lights it from aside, 0 to 1.
    facing
        Median of the cosines at which camera or projector, whichever is more oblique, meet its cells.
    hint
        Side that something else told, +1 or -1, 0 where nothing did.

    """

    cells: Bools
    above: int
    below: int
    unmeasured: int
    contrast: float
    crest_mm: float = np.nan
    floor_mm: float = np.nan
    told: Told | None = None
    aside: float = 0.0
    lit: float = 0.0
    facing: float = 1.0
    hint: int = 0

    @property
    def depth_tells(self) -> bool:
        """Whether at least half of the place has a depth."""
        return self.above + self.below >= self.unmeasured

    @property
    def grazed(self) -> bool:
        """Whether camera or projector only graze it: enough to say what a burr is, not that there is one."""
        blind = not self.depth_tells and self.contrast < _PLAIN
        return self.facing < (_BLIND if blind else _GRAZED)

    @property
    def hidden(self) -> float:
        """Share of its cells without depth."""
        return self.unmeasured / max(self.above + self.below + self.unmeasured, 1)

    def seen_mm(self, side: int) -> float:
        """Height that its depths show on a side."""
        return self.crest_mm if side > 0 else self.floor_mm

    @property
    def side(self) -> int:
        """+1 where material is too much, -1 where it is missing."""
        return self.hint or (1 if self._standing >= 0.0 else -1)

    @property
    def undecided(self) -> bool:
        """Whether it is less than a standard deviation that tells the side."""
        return abs(self._standing) < 1.0

    @property
    def _standing(self) -> float:
        """What speaks for material too much, a difference of misfits: told, from aside, cells counted.

        What cells tell is bounded: walls of a nick that mirror each other show two thirds of them above.
        """
        more = self.above + _HIDES * self.unmeasured - self.below
        share = more / max(self.above + self.below + self.unmeasured, 1)
        told = self.told.ridge_over_nick if self.told is not None else 0.0
        told = min(max(told, -_MOST_TOLD), _MOST_TOLD)
        return told + self.aside + _ALL_ONE_SIDE * min(max(share, -1.0), 1.0)


def disturbed(
    sight: Sight, axis: Axis, generatrix: Generatrix, *, widest_mm: float, scratches: bool = False
) -> tuple[Unrolled, Looks, list[Place]]:
    """Every disturbed place of what camera and projector both see, largest first, and then thin lines.

    Parameters
    ----------
    sight
        What the scan saw.
    axis, generatrix
        The fitted surface.
    widest_mm
        Width of the widest burr that is looked for.
    scratches
        Whether places that wander flat over pixels, as scratches do, are told as well.

    Notes
    -----
    O(cells · widest_mm / cell), and a fifth of a second for what is told of each place.

    """
    surface = unrolled(axis, generatrix, sight.rig)
    light = surface.sampled(np.nan_to_num(sight.radiance.astype(float)), order=1)
    # a cell beside unknown light would get a share of nothing, and pass for dark
    unknown = surface.sampled(np.isnan(sight.radiance).astype(float), order=1)
    known = surface.open & (light > 0.0) & (unknown == 0.0)
    gap = max(round(0.5 * widest_mm / surface.step_mm), 2)
    half = max(round(2.7 * widest_mm / surface.step_mm), 4 * gap)
    with np.errstate(divide="ignore"):
        brightness = np.where(known, np.log(light), np.nan)
    turn = float(np.degrees(surface.angle[1] - surface.angle[0]))
    tilt = tilts_deg(surface, np.arange(len(surface.r_mm))) / turn
    rest, predicted, scatter = excess_of_lobe(brightness, known, tilt, half=half, gap=gap)
    measured, deviation = _depth(sight, axis, generatrix, surface)
    depths = np.where(measured & surface.open, deviation, np.nan)
    calm = cell_sigma(depths, surface.facing, least=_LEAST_SCATTER)
    off = measured & (np.abs(deviation) > _DEPTH_Z * calm)
    hole = ~measured & _measurable(predicted, measured, surface.open)
    # the dark sectors of an end face are noisy, and a parallel crosses them all
    usual = np.maximum(scatter[:, None], cell_sigma(rest, _shares(predicted), least=_LEAST_SCATTER))
    strange = np.abs(rest) > np.maximum(_LIGHT_Z * usual, _LEAST_CONTRAST)
    both = surface.open & strange & (hole | off)
    found = _places(both, surface.open & (hole | off), surface.open)
    taken = np.logical_or.reduce([np.zeros(surface.open.shape, bool), *found])
    thin = lines(rest, strange, np.where(measured, deviation / calm, np.nan), surface.open, taken)
    found += _places(both | thin, thin, surface.open)
    looks = Looks(brightness, predicted, np.where(measured, deviation, np.nan))
    stated, pixel = _stated(sight, surface), np.rint(surface.pixel).astype(np.int64)
    places = [
        _place(cells, hole, deviation, rest)
        for cells in found
        if not depths_are_noise(cells, looks.deviation_mm, stated, pixel)
        and not _is_a_glint(cells, rest, wide=widest_mm / surface.step_mm)
        and (scratches or not _scratched(cells, looks, surface))
    ]
    told = [
        _told(one, looks, surface, widest_mm=widest_mm)
        for one in places
        if one.depth_tells or _by_light_alone(one)
    ]
    return surface, looks, told


def _by_light_alone(place: Place) -> bool:
    """Whether light tells of a place with hardly any depth: strong light of a few cells, or faint of many."""
    evidence = place.contrast * float(np.sqrt(np.count_nonzero(place.cells)))
    return place.contrast >= _LONE_CONTRAST and evidence >= _LONE_EVIDENCE


def _told(place: Place, looks: Looks, surface: Unrolled, *, widest_mm: float) -> Place:
    told = told_of(place.cells, looks, surface, widest_mm=widest_mm)
    at = stand(place.cells, surface)
    return replace(
        place,
        told=told,
        aside=0.0 if told is None else aside(place.cells, looks, at),
        lit=at.lit,
        facing=float(np.median(surface.facing[place.cells])),
    )


def _is_a_glint(cells: Bools, rest: Floats, *, wide: float) -> bool:
    """Whether the light of a place of ``wide`` columns or more changes as gradually as at no burr."""
    rows, columns = np.nonzero(cells)
    first, last = int(columns.min()), int(columns.max())
    if last - first + 1 < wide:
        return False
    near = slice(max(first - _BESIDE_CELLS, 0), last + _BESIDE_CELLS + 1)
    across = column_medians(rest[np.unique(rows), near])
    steps, size = np.abs(np.diff(across)), np.abs(across)
    if not np.isfinite(steps).any():
        return False
    return bool(np.nanmax(steps) < _GRADUAL * np.nanmax(size))


def _scratched(cells: Bools, looks: Looks, surface: Unrolled) -> bool:
    row, column = (int(np.median(each)) for each in np.nonzero(cells))
    return wanders_flat(cells, looks.deviation_mm, pixel_mm=depth_of_a_pixel_mm(surface, row, column))


def _depth(sight: Sight, axis: Axis, generatrix: Generatrix, surface: Unrolled) -> tuple[Bools, Floats]:
    """Where the cells' pixels were measured, and their deviation."""
    shape = sight.points_mm.shape[:2]
    deviation = deviation_mm(sight.points_mm.reshape(-1, 3), axis, generatrix).reshape(shape)
    share = surface.sampled(np.isfinite(sight.points_mm[..., 2]).astype(float), order=1)
    return share >= 0.5, surface.sampled(np.nan_to_num(deviation), order=0)


def _stated(sight: Sight, surface: Unrolled) -> Floats:
    """What the scan states that the cells' depths err by, along the normal.

    No less than that: a cell faces the camera by ``facing`` or more.
    """
    return surface.facing * surface.sampled(np.nan_to_num(sight.sigma_mm.astype(float)), order=0)


def _shares(predicted: Floats) -> Floats:
    """How bright cells should be, from the darkest, 0, to the brightest, 1; 0 where nobody knows."""
    known = predicted[np.isfinite(predicted)]
    low, high = float(known.min(initial=np.inf)), float(known.max(initial=-np.inf))
    return np.nan_to_num((predicted - low) / max(high - low, _LEAST_SCATTER))


def _measurable(predicted: Floats, measured: Bools, open_cells: Bools) -> Bools:
    """Cells for which light as strong as predicted was measured nearly everywhere."""
    known = open_cells & np.isfinite(predicted)
    level = np.zeros(predicted.shape, np.int64)
    level[known] = np.floor((predicted[known] - predicted[known].min(initial=np.inf)) / _LEVEL)
    seen = np.bincount(level[known], measured[known]) / np.maximum(np.bincount(level[known]), 1)
    return known & (seen[level] >= _MEASURABLE) if known.any() else known


def _places(core: Bools, off: Bools, open_cells: Bools) -> list[Bools]:
    """Connected cells about the core, largest first, that are not like their parallels all the way round."""
    near = np.ones((3, 3), bool)
    labels, count = ndimage.label(ndimage.binary_dilation(core, near) & off, near)
    large = []
    for number, box in enumerate(ndimage.find_objects(labels, count), 1):
        inside = labels[box] == number
        size, rows = int((core[box] & inside).sum()), len(inside)
        if size >= max(_LEAST_CELLS, _LEAST_FILL * rows) and rows >= _LEAST_ROWS:
            large.append((size, box[0], labels == number))
    # one burr is no reason to doubt another on the same parallels
    others = np.logical_or.reduce([cells for _, _, cells in large]) if large else np.zeros(core.shape, bool)
    beside = open_cells & ~ndimage.binary_dilation(others, near, iterations=4)
    kept = [one for one in large if beside[one[1]].any() and core[one[1]][beside[one[1]]].mean() <= _RARE]
    return [cells for _, _, cells in sorted(kept, key=lambda one: -one[0])]


def _place(cells: Bools, hole: Bools, deviation: Floats, rest: Floats) -> Place:
    depth = deviation[cells & ~hole]
    return Place(
        cells,
        above=int((depth > 0.0).sum()),
        below=int((depth < 0.0).sum()),
        unmeasured=int((cells & hole).sum()),
        contrast=float(np.nanmedian(np.abs(rest[cells]))),
        crest_mm=float(np.quantile(depth, HIGH)) if len(depth) else np.nan,
        floor_mm=float(np.quantile(-depth, HIGH)) if len(depth) else np.nan,
    )
