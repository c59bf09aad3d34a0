"""Burrs from the residual field around the generatrix: any number, any direction, both signs."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from burrscan.arrays import Bools, Floats, Ints, Ints32
from burrscan.axis.basis import T_part_mesh
from burrscan.burrs.along_edges.call import along_edges
from burrscan.burrs.bodies import TALLEST_MM, tallest
from burrscan.burrs.describe import Eye, Site, describe
from burrscan.burrs.detect import Region, regions, threshold
from burrscan.burrs.edges import View, on_edge
from burrscan.burrs.field import Field, field_of
from burrscan.burrs.grazed import FLATTEST, facing
from burrscan.burrs.height import judged, with_height
from burrscan.burrs.interreflected import is_interreflected
from burrscan.burrs.light.call import around, belongs, called, doubted, placed, share_of
from burrscan.burrs.light.disturbed import Place, disturbed
from burrscan.burrs.light.flat import is_an_edge
from burrscan.burrs.light.shine import MIRRORED, mirrored, walls_share
from burrscan.burrs.light.unrolled import Unrolled
from burrscan.burrs.local_cfar import boxed, convincing, without_satellites
from burrscan.burrs.mirror_image import burr_of, is_an_image
from burrscan.burrs.no_curve import MOST_WITHOUT, shares_without
from burrscan.burrs.noise.correlated_noise import Doubt, Noise, doubt_of, noise_around
from burrscan.burrs.noise.waves import WIDEST_MM
from burrscan.burrs.openings import MOST_OPEN, Openings
from burrscan.burrs.past_end import past_end
from burrscan.burrs.pose import share_around
from burrscan.generatrix.polyline import polyline_of
from burrscan.inspection import Axis, Burr, Generatrix, Value
from burrscan.sight import Sight

_MARGIN = 4
"""Cells around a region that its ridge is fitted with."""
_HALO, _CREST = 0.2, 0.95
"""Cells below a fifth of the crest (95 % point) are halo: noise, not the burr, decides where they end."""
_CLEARLY = 0.5
"""Share of the larger evidence from which a side's smaller one leaves the side open: flanks that mirror show
both."""
_STUMP = 0.5
"""Share of a disturbed place's rows: depth that shows less of it shows a stump of what stands there, and what
light tells of the whole counts."""
_EDGE_SPACINGS = 4.0
"""So many vertex spacings beside an edge no surface is faced either: cells and fillets are as wide."""
_FEWEST_INSIDE = 4
"""Fewer vertices than this off the border of the mesh are no evidence."""
_OF_WAVES = 0.5
"""Share of what waves differ by around an anomaly that they may be off by below it, all alike. Calls on what
was left of waves were 0.4 to 2.7 times as high as those differ, four in five true burrs over 4 times."""
_ROWS_OF_WAVES = 3
"""Rows of cells, a vertex and a half each: five calls on 150 clean views with waves were in one or two."""
_THROUGH = 0.6
"""Share of the columns of an anomaly that the crest of a burr runs through: lower are its ends, or torn."""


def burrs_residual(
    vertices_mm: Floats,
    faces: Ints32,
    axis: Axis,
    generatrix: Generatrix,
    *,
    sigma_mm: Floats | float | None = None,
    limit_mm: float | None = None,
    false_calls_per_wheel: float = 1e-6,
    sight: Sight | None = None,
    widest_mm: float = 3.0,
    tallest_mm: float = TALLEST_MM,
    several_views: bool = False,
) -> tuple[Burr, ...]:
    """Find every anomaly that noise would not show.

    Parameters
    ----------
    vertices_mm, faces
        (V, 3) and (T, 3) mesh.
    axis, generatrix
        The ideal surface.
    sigma_mm
        Stated standard deviation of the vertices, one or (V,): a lower bound; the data's own spread, which is
        measured locally, may be larger.
    limit_mm
        Largest permitted height (ISO 13715); each burr then says whether it is within.
    false_calls_per_wheel
        How many false burrs Gaussian noise may cause on a wheel without any, on average. The default leaves
        room for the heavier tails of real scans.
    sight
        What a scan saw besides the mesh. Where its light and its depth are both not the surface's there is an
        anomaly, though the depth alone may show none, or show light that bounced: see
        :mod:`burrscan.burrs.light.disturbed`.
    widest_mm
        Width of the widest burr that the light is asked for.
    tallest_mm
        What stands off further than that, and than a share of the largest radius, is a bar, a handle or a
        fixture, and no burr; see :mod:`burrscan.burrs.bodies`.
    several_views
        Other views will confirm or deny what this one shows. So it also calls what may be an edge of
        brightness (a scratch, say), which one view alone leaves out: :mod:`burrscan.burrs.light.flat`. And
        burrs along edges of which it has no depth are left to them: :mod:`burrscan.burrs.along_edges`.

    Returns
    -------
    tuple of Burr
        Most significant first.

    Notes
    -----
    O(V). Detection: :mod:`burrscan.burrs.detect`; measure: :mod:`burrscan.burrs.shape.ridge`.

    """
    line = polyline_of(generatrix)
    radius_mm = float(line.nodes_mm[:, 1].max())
    deepest_mm = tallest(tallest_mm, radius_mm, scanned=sight is not None)
    tallest_mm = tallest(tallest_mm, radius_mm, scanned=False)
    field = field_of(vertices_mm, faces, axis, generatrix, sigma_mm=sigma_mm, tallest_mm=deepest_mm)
    found = convincing(
        field, regions(field, false_calls_per_wheel=false_calls_per_wheel), cores=sight is not None
    )
    eye_mm = None if sight is None else np.zeros(3)
    low = {n: field.within(one.cells) for n, one in enumerate(found) if sight is not None and one.sign < 0}
    outlined = past_end(
        vertices_mm, axis, line, field, tallest_mm=tallest_mm, sigma_mm=sigma_mm, eye_mm=eye_mm, suspects=low
    )
    found = [region for number, region in enumerate(found) if number not in outlined.explained]
    openings = Openings(field) if found and sight is None else None
    view = None
    if sight is not None:
        view = View(line, sight.rig.centres_mm(T_part_mesh(axis.point_mm, axis.direction)))
    eye = None if view is None or sight is None else Eye(view.at_mm[0], 1.0 / sight.rig.camera.fx)
    certain, faint = _certain(
        field, found, axis, false_calls_per_wheel, openings, view=view, eye=eye, widest_mm=widest_mm
    )
    certain = _with_a_curve_around(certain, field, faces)
    known = _place_known(axis, within_mm=field.spacing_mm)
    seen: list[Burr] = []
    shines = 0.0
    if sight is None:
        certain = [one for one in certain if one.burr.height_mm.value <= tallest_mm]
    else:
        surface, looks, places = disturbed(
            sight, axis, generatrix, widest_mm=widest_mm, scratches=several_views
        )
        if not known:
            places = []
        shines = mirrored(looks, surface)
        image = partial(is_interreflected, axis=axis, line=line, rig=sight.rig)
        certain = [one for one in certain if not image(vertices_mm[_crest_of(field, one)])]
        places = [place for place in places if not image(_measured(sight, surface, place))]
        certain = [one._replace(burr=_mirroring(one.burr, shines)) for one in certain]
        places = [one for one in places if not any(around(each.burr, one, surface, axis) for each in certain)]
        certain, dark = _told_by_light(certain, faint, places, surface, axis)
        dark = [place for place in dark if not place.grazed]
        seen = [called(place, surface, axis) for place in dark]
        if not several_views:
            edge = partial(is_an_edge, looks=looks, surface=surface, axis=axis)
            certain = [one for one in certain if not edge(one.burr, by_depth=True)]
            seen = [
                one
                for one, place in zip(seen, dark, strict=True)
                if not (place.depth_tells and edge(one, by_depth=False))
            ]
        certain = [
            one._replace(burr=placed(one.burr, one.place, surface, axis, mirrored=shines))
            if one.place
            else one
            for one in certain
        ]
    kept = without_satellites(field, [one.region for one in certain], [one.size for one in certain])
    burrs = [*(certain[i].burr for i in kept), *seen, *outlined.burrs]
    if sight is not None:
        if known and not several_views:
            burrs += along_edges(sight, axis, generatrix, called=burrs)
        scattered = float(np.sqrt(1.0 - shines**2))
        burrs = [_less_sure(burr, share=scattered * walls_share(burr)) for burr in burrs]
    return tuple(judged(burr, limit_mm) for burr in sorted(burrs, key=lambda burr: -burr.significance))


class _Certain(NamedTuple):
    """A burr that its depth shows, its height in standard deviations, and the field's vertices on it.

    With the disturbed place that tells of it, if there is one.
    """

    region: Region
    burr: Burr
    size: float
    on: Ints
    place: Place | None = None


def _place_known(axis: Axis, *, within_mm: float) -> bool:
    """Whether the axis's place is known to a vertex: of an end face alone it is not.

    Then nobody knows where edges are, and light that changes at one is no evidence.
    """
    unknown: bool = np.trace(axis.covariance[2:, 2:]) > within_mm**2  # NaN where a method states none
    return not unknown


def _certain(
    field: Field,
    found: list[Region],
    axis: Axis,
    false_calls_per_wheel: float,
    openings: Openings | None,
    *,
    view: View | None,
    eye: Eye | None,
    widest_mm: float,
) -> tuple[list[_Certain], list[_Certain]]:
    """What is left of the regions when shared errors are counted, without those beside openings.

    And what these errors may be all of, but which has a shape.

    ``openings`` is None for a scan, which is judged by its light, and where nicks may be mirror images;
    ``view`` is from where a scan looked, None where nobody knows. What it only grazes is left out, unless an
    edge puts it into the light.
    """
    if not found:
        return [], []
    least = threshold(int((field.count > 0).sum()), false_calls_per_wheel=false_calls_per_wheel)
    doubt = doubt_of(field)
    certain: list[_Certain] = []
    faint: list[_Certain] = []
    anywhere = "position" in axis.undetermined  # then the border of a face may be its rounding, or a step
    for region, site in _sites(field, found):
        if anywhere and field.border[site.chosen[site.on]].any():
            continue
        beside = _EDGE_SPACINGS * field.spacing_mm
        air = openings is None and on_edge(
            field, site.chosen[site.on], region.sign, within_mm=beside, ends_in=view
        )
        cosine = 0.0 if view is None else facing(field, site.chosen[site.on], view.at_mm)
        if view is not None and not air and cosine < FLATTEST:
            continue
        crest, high, noise = _crest(field, doubt, site, columns=_columns(region) if air else 0)
        own_mm = noise.own_mm * float(np.sqrt(3.0 / max(len(crest), 1)))
        if high <= least * own_mm:  # not sure even if its vertices share no errors: no need to measure it
            continue
        if openings and openings.beside(region) > MOST_OPEN and not on_edge(field, crest, region.sign):
            continue
        burr = describe(field, site, axis, facing=cosine, eye=eye)
        waves_mm = _OF_WAVES * float(np.median(field.waves_mm[crest]))
        if burr is None or (waves_mm > 0.0 and _like_waves(field, crest, burr)):
            continue
        if openings is None and burr.side == "nick" and is_an_image(field, site.chosen[site.on]):
            burr = burr_of(burr, widest_mm=widest_mm)
        along = 1.0 if air else float(np.sqrt(max(1.0 - share_around(burr, axis) ** 2, 0.0)))
        shared_mm = noise.shared_mm / float(np.sqrt(_looks(field, crest, burr, along=along)))
        shared_mm = float(np.hypot(shared_mm, waves_mm))
        size = high / float(np.hypot(own_mm, shared_mm))
        sure = _less_sure(burr, share=shared_mm / burr.height_mm.value)
        kind = certain if size > least else faint
        kind.append(_Certain(region, sure, size, site.chosen[site.on]))
    return certain, faint


def _like_waves(field: Field, crest: Ints, burr: Burr) -> bool:
    """Whether an anomaly is as wide as waves, or all in a row or two: a corner's row errs as the wave there.

    On convex edges burrs are in no more rows.
    """
    few = np.ptp(field.cell[crest, 0]) + 1 < _ROWS_OF_WAVES
    return burr.width_mm.value > WIDEST_MM or (bool(few) and not on_edge(field, crest, burr.sign))


def _with_a_curve_around(certain: list[_Certain], field: Field, faces: Ints32) -> list[_Certain]:
    """The burrs without what are edges of surfaces that have no curve."""
    if not certain:
        return []
    shares = shares_without(faces, field.without_curve, [field.vertex[one.on] for one in certain])
    return [one for one, share in zip(certain, shares, strict=True) if share <= MOST_WITHOUT]


def _crest_of(field: Field, one: _Certain) -> Ints:
    """Numbers of the mesh's vertices that are high on a burr."""
    crest, _ = _highest(field, one.on, one.region.sign)
    return field.vertex[crest]


def _measured(sight: Sight, surface: Unrolled, place: Place) -> Floats:
    """(N, 3) what was measured at a place, camera frame."""
    row, column = np.rint(surface.pixel[:, place.cells]).astype(np.int64)
    points: Floats = sight.points_mm[row, column]
    return points[np.isfinite(points[:, 2])]


def _told_by_light(
    certain: list[_Certain], faint: list[_Certain], places: list[Place], surface: Unrolled, axis: Axis
) -> tuple[list[_Certain], list[Place]]:
    """The burrs less those of another side than the light tells, and places with no burr left.

    Where the light does not tell the side depth does, where it shows it, if only faintly.
    A burr of which depth shows a stump is as the light tells it. The largest place speaks first: what lies
    beside a burr that it confirmed is that burr's mirror image.
    """
    open_ = list(certain)
    confirmed: list[_Certain] = []
    dark: list[Place] = []
    for place in places:
        if any(belongs(one.burr, place, surface) for one in confirmed):
            continue
        here = [belongs(one.burr, place, surface) for one in open_]
        beside = [one for one, near in zip(open_, here, strict=True) if near]
        side = place.side
        if place.undecided:
            hints = [one for one in faint if belongs(one.burr, place, surface)]
            side = _of_one_mind(beside) or _of_one_mind(hints) or side
        same = [one for one in beside if one.burr.sign == side]
        open_ = [one for one, near in zip(open_, here, strict=True) if not near]
        if not same:
            dark.append(place if side == place.side else replace(place, hint=side))
        elif side == place.side and share_of(place, [one.burr for one in same], surface) < _STUMP:
            stump = max(same, key=lambda one: one.size)
            confirmed.append(stump._replace(burr=called(place, surface, axis), place=place))
        else:
            confirmed += [one._replace(burr=doubted(one.burr, place, surface), place=place) for one in same]
    return open_ + confirmed, dark


def _of_one_mind(beside: list[_Certain]) -> int:
    """Sign of the side that the depth shows at a place; 0 where it shows the other one half as clearly."""
    up, down = (max((one.size for one in beside if one.burr.sign == sign), default=0.0) for sign in (1, -1))
    clear = min(up, down) < _CLEARLY * max(up, down)
    return (1 if up > down else -1) if clear else 0


def _mirroring(burr: Burr, shines: float) -> Burr:
    """The burr less sure by what of its light is mirrored, before it is compared with what the light tells.

    That knows the light that walls mirror into each other. What they scatter neither knows.
    """
    return _less_sure(burr, share=shines * float(np.hypot(MIRRORED, walls_share(burr))))


def _less_sure(burr: Burr, *, share: float) -> Burr:
    """The burr with sizes that allow for an error of all its height, a share of it."""
    height = burr.height_mm
    wider = Value(height.value, float(np.hypot(height.sigma, share * height.value)))
    return with_height(burr, wider, share=share)


def _sites(field: Field, found: list[Region]) -> list[tuple[Region, Site]]:
    taken = np.zeros(field.count.shape, dtype=np.bool_)
    for region in found:
        taken |= region.cells
    return [(region, _site(field, region, taken)) for region in found]


def _crest(field: Field, doubt: Doubt, site: Site, *, columns: int) -> tuple[Ints, float, Noise]:
    """The vertices that an anomaly's height rests on, their typical height, mm, and what they err by.

    Errors that neighbours share are counted. No vertices where there are too few.

    What is on the border of the mesh is no evidence, see :mod:`burrscan.burrs.noise.border`, and spoils
    what is beside it. But a burr on an edge may be the border of what is seen. There,
    where it is as many ``columns`` long (0 elsewhere) and its crest runs through most of them, it is compared
    with the border beside it. That of specks in a shadow's border does not.
    """
    every, on = site.chosen[site.on], _inside(field, site)
    ragged = 2 * len(on) < len(every)
    crest, high = _highest(field, every, site.sign)
    if not (ragged and columns and len(np.unique(field.cell[crest, 1])) >= _THROUGH * columns):
        crest, high = _highest(field, on, site.sign)
    if not len(crest):
        return crest, high, Noise(0.0, 0.0)
    return crest, high, noise_around(field, doubt, crest, site.chosen, ragged=ragged)


def _highest(field: Field, on: Ints, sign: int) -> tuple[Ints, float]:
    """The higher ones of some vertices, and how high they typically are, mm; none of too few."""
    lift = sign * field.deviation_mm[on]
    if np.count_nonzero(lift > 0.0) < _FEWEST_INSIDE:
        return on[:0], 0.0
    high = float(np.quantile(lift[lift > 0.0], 0.8))
    return on[lift >= 0.5 * high], high


def _columns(region: Region) -> int:
    return int(np.count_nonzero(region.cells.any(axis=0)))


def _inside(field: Field, site: Site) -> Ints:
    """The vertices that belong to an anomaly and are not on the border of the mesh."""
    every = site.chosen[site.on]
    return every[~field.border[every]]


def _looks(field: Field, crest: Ints, burr: Burr, *, along: float) -> float:
    """How many independent values shared errors have on a burr: they are as wide as they are long.

    Up a burr there are as many as it is longer than wide, as far as its crest is seen. Along a parallel there
    is one, for light bounces between surfaces that run along parallels; but at the convex edges of a scan no
    surface faces another. ``along`` is the cosine between the burr and the direction in which there are
    several.
    """
    width: float = max(burr.width_mm.value, 2.0 * field.spacing_mm)
    stretches = [np.floor(place / width) for place in (field.along_mm[crest], field.arc_mm(crest))]
    seen = max(len(set(each.tolist())) for each in stretches)
    return max(min(burr.length_mm.value / width, seen) * along, 1.0)


def _site(field: Field, region: Region, taken: Bools) -> Site:
    chosen = _around(field, region, taken)
    on = region.cells[field.cell[chosen, 0], field.cell[chosen, 1]]
    on[on] = _high(field, chosen[on], region.sign)
    return Site(chosen, on, region.sign, region.significance, region.inflation)


def _high(field: Field, on: Ints, sign: int) -> Bools:
    """Which vertices are in cells that reach a fifth of what the highest reach: the others are halo.

    The highest are those that half of the squared deviations are in, where they are too few for a quantile:
    a burr that a wave has joined to many cells.
    """
    _, cell, count = np.unique(field.flat_cell[on], return_inverse=True, return_counts=True)
    level = np.bincount(cell, sign * field.deviation_mm[on]) / count
    order = np.argsort(level)
    power = np.cumsum((count * np.maximum(level, 0.0) ** 2)[order])
    half = level[order[np.searchsorted(power, 0.5 * power[-1])]]
    high: Bools = (level >= _HALO * max(np.quantile(level, _CREST), half))[cell]
    return high


def _around(field: Field, region: Region, taken: Bools) -> Ints:
    """Vertices in the region's bounding box and a margin, without those of other regions."""
    near = boxed(region.cells, _MARGIN, _MARGIN, closed=field.closed) & ~(taken & ~region.cells)
    return field.within(near)
