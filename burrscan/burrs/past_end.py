"""Burrs that go on where the surface ends: on an edge beyond which no surface is seen.

A view from aside shows a cylinder and not its end face. A burr that stands on the edge along the axis then
has no surface to stand off from: it is more of the cylinder. But around the wheel the surface ends in a
straight line, and there it does not.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from scipy import ndimage

from burrscan.arrays import Bools, Floats, Ints
from burrscan.burrs.field import Field
from burrscan.burrs.pose import pose_on_surface
from burrscan.generatrix.polyline import Polyline, is_closed
from burrscan.generatrix.profile import profile_of
from burrscan.inspection import Axis, Burr, Value
from burrscan.robust import SIGMA_PER_MEDIAN

_STRAIGHT = 0.7
"""Share of the columns that end within a vertex spacing of the median: a straight edge. Where fewer do, what
is seen ends in a shadow, at the horizon or in a tread."""
_FEWEST = 12
"""Columns by which a straight edge is told: of fewer seven in ten may be alike by chance."""
_BEYOND = 2.5
"""Vertex spacings by which a column must run on: an edge that smears is a vertex too long, or two."""
_WINDOWS = ((1, _BEYOND), (9, 1.2), (27, 0.8))
"""Columns of which the mean is taken, and by how many vertex spacings it must be further."""
_KNOWN = 0.7
"""Share of a window's columns that must be known."""
_SIGMAS = 6.0
"""And so many times the scatter of the ends."""
_LEAST_COLUMNS = 3
"""A burr is so many columns wide; single vertices fly. And it is longer than high: bars and pegs are not."""
_TALL = 0.8
"""Quantile of a burr's columns that is its height: its ends are lower, and the furthest vertex is noise."""
_GAP = 3
"""Columns without a vertex that may lie within a burr."""
_MOST = 0.3
"""Share of the columns that may run on: with more the edge is elsewhere."""
_SLOPE = 1.0
"""How far, over how far it runs on, a burr may lean off the surface: 45 degrees."""

_WRAP: Final = "wrap"
_CONSTANT: Final = "constant"
"""How a row of columns goes on where it ends: a closed one with its start."""


class _End(NamedTuple):
    """An open end of the curve: its place, the direction in which it would go on, and the outward normal."""

    place: Floats
    ahead: Floats
    normal: Floats


def past_end(
    vertices_mm: Floats, axis: Axis, line: Polyline, field: Field, *, tallest_mm: float
) -> list[Burr]:
    """Burrs beyond the open ends of the curve. O(V) for each end.

    Parameters
    ----------
    vertices_mm
        (V, 3) mesh.
    axis, line
        The ideal surface.
    field
        Its residual field, whose vertex spacing and columns are used.
    tallest_mm
        What runs on further is no burr.

    """
    ends, found = _ends(line), []
    if not ends:
        return []
    profile = profile_of(vertices_mm, axis)
    places = np.stack([profile.z_mm, profile.r_mm], axis=1)
    for end in ends:
        away = places - end.place
        ahead, off = away @ end.ahead, away @ end.normal
        near = (ahead > -_BEYOND * field.spacing_mm) & (ahead < 2.0 * tallest_mm)
        near &= np.abs(off) < field.spacing_mm + _SLOPE * np.maximum(ahead, 0.0)
        found += _beyond(end, ahead[near], profile.angle[near], axis, field, tallest_mm)
    return found


def _ends(line: Polyline) -> list[_End]:
    found = []
    for first, last in line.pieces:
        nodes = line.nodes_mm[first : last + 1]
        if is_closed(nodes):
            continue
        for place, before, side in ((nodes[0], nodes[1], -1.0), (nodes[-1], nodes[-2], 1.0)):
            ahead = (place - before) / np.linalg.norm(place - before)
            found.append(_End(place, ahead, side * np.array([-ahead[1], ahead[0]])))
    return found


def _beyond(
    end: _End, ahead: Floats, angle: Floats, axis: Axis, field: Field, tallest_mm: float
) -> list[Burr]:
    """The runs of columns that go on where most end."""
    radius = max(float(end.place[1]), field.spacing_mm)
    columns = max(int(field.arc[1] * radius / field.spacing_mm), 1)
    column = ((angle - field.arc[0]) % (2.0 * np.pi) / field.arc[1] * columns).astype(np.int64)
    column = np.minimum(column, columns - 1)
    reach = np.full(columns, -np.inf)
    np.maximum.at(reach, column, ahead)
    known = np.isfinite(reach)
    if np.count_nonzero(known) < _FEWEST:
        return []
    off = reach - np.median(reach[known])
    if np.mean(np.abs(off[known]) < field.spacing_mm) < _STRAIGHT:
        return []
    scatter = SIGMA_PER_MEDIAN * float(np.median(np.abs(off[known])))
    further = _further(np.where(known, off, np.nan) / field.spacing_mm, closed=field.closed)
    if np.count_nonzero(further) > _MOST * np.count_nonzero(known):
        return []
    burrs = []
    for run in _runs(further, closed=field.closed):
        place = run % columns
        high = off[place[further[place] & known[place]]]
        tall = float(np.quantile(high, _TALL)) if len(high) >= _LEAST_COLUMNS else np.inf
        if high.max(initial=0.0) < tallest_mm and tall < len(run) * field.arc[1] / columns * radius:
            burrs.append(_burr(end, high, run, columns, radius, scatter, axis, field))
    return burrs


def _further(off: Floats, *, closed: bool) -> Bools:
    """Columns that run on: alone, or in the mean with those beside them.

    ``off`` is in vertex spacings, NaN where nothing is known.
    """
    known, mode = np.isfinite(off), _WRAP if closed else _CONSTANT
    values, further = np.where(known, off, 0.0), np.zeros(len(off), np.bool_)
    for size, least in _WINDOWS:
        if size > len(off):
            continue
        share = ndimage.uniform_filter1d(known.astype(float), size, mode=mode)
        mean = ndimage.uniform_filter1d(values, size, mode=mode) / np.maximum(share, 1e-9)
        full = share >= _KNOWN
        if not full.any():
            continue
        middle = float(np.median(mean[full]))
        scatter = SIGMA_PER_MEDIAN * float(np.median(np.abs(mean[full] - middle)))
        centres = full & (mean - middle > max(least, _SIGMAS * scatter))
        level = ndimage.maximum_filter1d(np.where(centres, mean, 0.0), size, mode=mode)
        further |= (level > 0.0) & known & (values > 0.5 * level)
    return further


def _runs(further: Bools, *, closed: bool) -> list[Ints]:
    """Stretches of columns, with gaps of single ones; a closed field's may go on past its last column."""
    start = int(np.argmin(further | np.roll(further, -1))) if closed else 0  # where no stretch is cut
    at = start + np.flatnonzero(np.roll(further, -start))
    if not len(at):
        return []
    return [
        np.arange(run[0], run[-1] + 1) for run in np.split(at, np.flatnonzero(np.diff(at) > 1 + _GAP) + 1)
    ]


def _burr(
    end: _End,
    high: Floats,
    run: Ints,
    columns: int,
    radius: float,
    scatter: float,
    axis: Axis,
    field: Field,
) -> Burr:
    """A burr of which an outline is known: its length and its height, and nothing of its width."""
    step = field.arc[1] / columns
    angle = field.arc[0] + (0.5 * (run[0] + run[-1]) + 0.5) * step
    angle = float(np.angle(np.exp(1j * angle)))
    tall = float(np.quantile(high, _TALL))
    sigma = float(np.hypot(field.spacing_mm / np.sqrt(12.0), scatter))
    z = sorted((float(end.place[0]), float(end.place[0] + tall * end.ahead[0])))
    length = len(run) * step * radius
    unknown = Value(np.nan, np.nan)
    return Burr(
        side="protrusion",
        angle_deg=Value(float(np.degrees(angle)), float(np.degrees(0.4 * step))),
        z_start_mm=Value(z[0], 0.4 * field.spacing_mm),
        z_end_mm=Value(z[1], 0.4 * field.spacing_mm),
        height_mm=Value(tall, sigma),
        width_mm=unknown,
        length_mm=Value(length, 0.4 * np.sqrt(2.0) * step * radius),
        area_mm2=unknown,
        volume_mm3=unknown,
        T_mesh_burr=pose_on_surface(end.place, end.normal, angle, np.array([1.0, 0.0]), axis),
        significance=tall / sigma * float(np.sqrt(len(high))),
    )
