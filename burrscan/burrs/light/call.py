"""Disturbed places become burrs, and decide the side of what the depth alone shows there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from burrscan.arrays import Floats
from burrscan.burrs.height import combined, with_height
from burrscan.burrs.light.disturbed import HIGH, Place
from burrscan.burrs.light.unrolled import Unrolled
from burrscan.burrs.pose import pose_on_surface, share_around, turned_to
from burrscan.inspection import Axis, Burr, Value, side_of
from burrscan.turns import turn_deg, turn_rad

HEIGHT_PER_WIDTH = 0.7
"""See the sigma."""
_HEIGHT_SIGMA = 0.17
"""What is disturbed is the base and what the burr hides. The base is between half and twice the height, what
it hides about a third of it: height over width is evenly spread from 0.4 to 1.0, 0.7 with sigma 0.17."""
_MUCH = 0.2
"""Share of a place without depth from which the rest is doubted: in nicks and on rough burrs it is less."""
_CONTRADICTS = 2.0
"""Standard deviations of the height told from which one that was measured contradicts it."""
_HIDDEN = 0.1
"""Share of a place without depth up to which its depths speak for all of it."""
_SEEN_SIGMA = 0.3
"""Error of a height that a place's depths show, as a share of it: cells take a crest for what is beside it.
Of 21 rendered burrs below 0.5 mm that the light alone called, the depths err by that much."""
_PARTLY = 0.3
"""Error of a depth that is lit from aside, as a share of the height: of a wall the projector reaches a part.
Of 310 burrs on that flank of rendered wheels 95 % of the heights are then within 1.9 standard deviations (2.2
of nicks; 6 and 21 without), with 0.2 within 2.0 and 2.8."""
_AROUND = np.cos(np.radians(45.0))
"""Cosine to the parallel from which a burr runs more around the wheel than along it."""
_MOSTLY = 0.5
"""Share of a place's cells: with more of them on a burr it is that burr's."""
_REACH_CELLS = 2.0
"""A call belongs to a place that it overlaps, or nearly."""


def belongs(burr: Burr, place: Place, surface: Unrolled) -> bool:
    """Whether a burr called by its depth stands at a disturbed place."""
    rows, columns = np.nonzero(place.cells)
    reach = _REACH_CELLS * surface.step_mm
    z, r = surface.z_mm[rows], float(surface.r_mm[rows].mean())
    if burr.z_end_mm.value < z.min() - reach or burr.z_start_mm.value > z.max() + reach:
        return False
    turn = turn_rad(surface.angle[columns] - np.radians(burr.angle_deg.value))
    half = 0.5 * burr.width_mm.value if np.isfinite(burr.width_mm.value) else 0.0
    return bool(np.abs(turn).min() * r <= reach + half)


def share_of(place: Place, burrs: Sequence[Burr], surface: Unrolled) -> float:
    """Share of a place's rows that burrs reach along the axis."""
    z = surface.z_mm[np.unique(np.nonzero(place.cells)[0])]
    reached = [(z >= burr.z_start_mm.value) & (z <= burr.z_end_mm.value) for burr in burrs]
    return float(np.any(reached, axis=0).mean())


def around(burr: Burr, place: Place, surface: Unrolled, axis: Axis) -> bool:
    """Whether a disturbed place is part of a burr that runs around the wheel.

    The light is asked for what runs along the wheel: of a burr along an edge it shows the ends, and of these
    neither side nor height follow.
    """
    if share_around(burr, axis) < _AROUND:
        return False
    rows, columns = np.nonzero(place.cells)
    reach, z, r = _REACH_CELLS * surface.step_mm, surface.z_mm[rows], surface.r_mm[rows]
    turn = turn_rad(surface.angle[columns] - np.radians(burr.angle_deg.value))
    inside = np.abs(turn) * r <= 0.5 * burr.length_mm.value + reach
    inside &= (z >= burr.z_start_mm.value - reach) & (z <= burr.z_end_mm.value + reach)
    return bool(np.count_nonzero(inside) > _MOSTLY * len(rows))


def doubted(burr: Burr, place: Place, surface: Unrolled) -> Burr:
    """A burr called by its depth: what was measured may be light that bounced.

    Burrs mirrored in each other's flanks, or in the wheel beside them, look higher than they are. Where its
    height is above what is told of the place without it, and no burr of that height explains what is seen
    nearly as well as others do, it takes the height told. So it does where much of the place has no depth and
    its height contradicts the one told, or is one that explains nothing, however little is told; where it
    does not, its sigma grows by the part of the place that nobody measured. What is then left of depth and
    light has little in common, and each has its weight.

    With the baseline along the burr what bounced off its flanks leaves the plane of the rays, and passes for
    no depth that all rows share: what a fifth of a place's depths exceed is its height then, where all of it
    has some, and what is told has its weight beside that where it is surer. Nothing that light tells is as
    sure as a height that it does not contradict there; see :func:`_lengthways`. O(cells).
    """
    told, depth, share = _told(place, surface, side=burr.sign), burr.height_mm, place.hidden
    off = (depth.value - told.value) / told.sigma
    never = place.told is not None and place.told.contradicts(depth.value, side=burr.sign)
    doubtful = (never and off > _CONTRADICTS) or (share > _MUCH and (never or abs(off) > _CONTRADICTS))
    if doubtful and not (place.told is not None and _lengthways(place, surface)):
        return with_height(burr, told, share=told.sigma / told.value)
    seen_mm = place.seen_mm(burr.sign)
    if doubtful and share <= _HIDDEN and 0.0 < seen_mm < max(depth.value, told.value):
        height = _seen(seen_mm, place, told)
        if told.sigma < _SEEN_SIGMA * told.value:
            height = combined(height, told)
    else:
        part = _PARTLY * place.lit * max(depth.value, told.value)
        missed = share * told.sigma if share > _MUCH else 0.0
        height = Value(depth.value, float(np.sqrt(depth.sigma**2 + part**2 + missed**2)))
        sure = not doubtful and share <= _MUCH
        if place.told is not None and not (sure and _lengthways(place, surface)):
            height = combined(height, told)
    more = max(height.sigma**2 - depth.sigma**2, 0.0)
    return with_height(burr, height, share=float(np.sqrt(more)) / height.value)


def _lengthways(place: Place, surface: Unrolled) -> bool:
    """Whether the baseline lies along a place that runs along the axis, rather than across it.

    Of 63 rendered burrs across it whose height the light contradicts the fit is 2.4 times as high as the burr
    in the median, and what is told 0.95; of 58 along it the fit is 1.2, and what a fifth of the place's
    depths exceed 0.9. Where nothing is contradicted, of 36 along it, the fit is 0.99 of the height and off by
    8 % (robustly), what is told 0.98 and off by 33; of 52 across it they are off by 20 and 26 %.
    """
    rows, columns = np.nonzero(place.cells)
    row, angle = int(np.median(rows)), float(surface.angle[columns].mean())
    baseline, (nz, nr) = surface.projector_mm - surface.camera_mm, surface.normal[row]
    outward = baseline[0] * np.cos(angle) + baseline[1] * np.sin(angle)
    around = baseline[1] * np.cos(angle) - baseline[0] * np.sin(angle)
    return bool(abs(nr * baseline[2] - nz * outward) >= abs(around))


def placed(burr: Burr, place: Place, surface: Unrolled, axis: Axis, *, mirrored: float) -> Burr:
    """A burr called by its depth, at the angle that ridges or nicks laid beside the place tell.

    Seen from aside, light that went by way of its flank and the wheel before it looks high, one to three
    heights beside the burr, and is brighter than the burr itself. What was laid beside the place has it, too.
    So a depth may be off by the burr's height, as far as light is ``mirrored``, 0 to 1; where that is less
    than what the light leaves open, the depth's angle stands.
    """
    if place.told is None or share_around(burr, axis) >= _AROUND:
        return burr
    rows = np.nonzero(place.cells)[0]
    off = mirrored * burr.height_mm.value / float(np.median(surface.r_mm[rows]))
    shown = Value(
        float(np.radians(burr.angle_deg.value)), float(np.hypot(np.radians(burr.angle_deg.sigma), off))
    )
    angle = place.told.angle_rad(side=burr.sign, depth=shown)
    if shown.sigma <= angle.sigma:
        return replace(burr, angle_deg=Value(burr.angle_deg.value, float(np.degrees(shown.sigma))))
    return turned_to(burr, angle, float(np.median(surface.z_mm[rows])), axis)


def _extents(place: Place, surface: Unrolled) -> tuple[float, float]:
    """Median extent of a place around the axis, and its extent along the surface, mm."""
    rows = np.nonzero(place.cells)[0]
    turn = float(surface.angle[1] - surface.angle[0])
    used, each = np.unique(rows, return_counts=True)
    return float(np.median(each * surface.r_mm[used])) * turn, len(used) * surface.step_mm


def _told(place: Place, surface: Unrolled, *, side: int) -> Value:
    """The height that ridges or nicks laid beside a place tell, or its width where none can be.

    A width is counted in cells: up to half a one is off on either side.
    """
    if place.told is not None:
        return place.told.height(side=side)
    width, counted = min(_extents(place, surface)), surface.step_mm / np.sqrt(6.0)
    return Value(HEIGHT_PER_WIDTH * width, float(np.hypot(_HEIGHT_SIGMA * width, HEIGHT_PER_WIDTH * counted)))


def _seen(seen_mm: float, place: Place, told: Value) -> Value:
    """The height that the depths of a place show, less sure where it is lit from aside."""
    return Value(seen_mm, float(np.hypot(_SEEN_SIGMA * seen_mm, _PARTLY * place.lit * told.value)))


def _unseen(place: Place, told: Value) -> Value:
    """The height of a place where no depth shows a burr: the one told, with that of its depths if it is less.

    Light that bounced between burr and wheel looks farther from the surface than what it came from, so depths
    that stay below what the light lets expect came directly. Of a triangle all depths are equally frequent:
    what a fifth of them exceed is four fifths of its height.
    """
    seen_mm = place.seen_mm(place.side)
    if place.hidden > _HIDDEN or not 0.0 < seen_mm < told.value:
        return told
    return combined(_seen(seen_mm / HIGH, place, told), told)


def called(place: Place, surface: Unrolled, axis: Axis) -> Burr:
    """A burr of which the light tells the place and the extent, and the depth no height.

    Its height follows from what burrs of its width would show, and its sigma says how little that is, unless
    its depths show less.
    O(cells).
    """
    rows, columns = np.nonzero(place.cells)
    middle = int(np.median(rows))
    step, r = surface.step_mm, float(surface.r_mm[middle])
    across, along = _extents(place, surface)
    width, length = sorted((across, along))
    z = surface.z_mm[rows]
    angle = Value(float(surface.angle[columns].mean()), across / np.sqrt(12.0) / r)
    if place.told is not None:
        angle = place.told.angle_rad(side=place.side)
    height = _unseen(place, _told(place, surface, side=place.side))
    area, area_sigma = 0.5 * height.value * width, 0.5 * height.sigma * width
    foot: Floats = np.array([surface.z_mm[middle], r])
    direction = np.array([0.0, 1.0]) if along >= across else np.array([1.0, 0.0])
    return Burr(
        side=side_of(place.side),
        angle_deg=Value(turn_deg(float(np.degrees(angle.value))), float(np.degrees(angle.sigma))),
        z_start_mm=Value(float(z.min()) - 0.5 * step, step),
        z_end_mm=Value(float(z.max()) + 0.5 * step, step),
        height_mm=height,
        width_mm=Value(width, width / np.sqrt(12.0)),
        length_mm=Value(length, step),
        area_mm2=Value(area, area_sigma),
        volume_mm3=Value(area * length, area_sigma * length),
        T_mesh_burr=pose_on_surface(foot, surface.normal[middle], angle.value, direction, axis),
        significance=float(np.sqrt(place.cells.sum())),
    )
