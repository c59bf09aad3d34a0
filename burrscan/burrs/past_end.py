"""Burrs that go on where the surface ends: on an edge beyond which no surface is seen.

A view from aside shows a cylinder and not its end face. A burr that stands on the edge along the axis then
has no surface to stand off from: it is more of the cylinder. But around the wheel the surface ends in a
straight line, and there it does not.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from burrscan.arrays import Bools, Floats, Ints
from burrscan.axis.basis import T_part_mesh
from burrscan.burrs.field import Field
from burrscan.burrs.pose import pose_on_surface
from burrscan.burrs.reach import (
    BEYOND,
    FEWEST,
    WINDOWS,
    WINDOWS_SEEN,
    between_steps,
    further,
    reach_of,
    runs_of,
    runs_on,
    steps_out,
    usual_reach,
)
from burrscan.generatrix.polyline import Polyline, is_closed
from burrscan.generatrix.profile import profile_of
from burrscan.inspection import Axis, Burr, Value
from burrscan.pose import placed
from burrscan.robust import SIGMA_PER_MEDIAN
from burrscan.turns import turn_rad

_STRAIGHT = 0.6
"""Share of the columns that end within a vertex spacing of the median: a straight edge. Where fewer do, what
is seen ends in a shadow, at the horizon or in a tread."""
_LEAST_COLUMNS = 3
"""A burr is so many columns wide; single vertices fly. And it is longer than high: bars and pegs are not."""
_TALL = 0.8
"""Quantile of a burr's columns that is its height: its ends are lower, and the furthest vertex is noise."""
_BESIDE = 4.0
"""Vertex spacings from an end within which the flank of a burr that stands on it begins."""
_BEFORE, _MOSTLY = 4.0, 0.5
"""Vertex spacings beyond an end within which what hides the rest of the surface is seen, nearer to the
camera, and the share of the columns where it is."""
_ROUND = 0.5
"""Of the radius of the edge that it stands on, what a burr is lower than: one view shows the far wall of a
bore, and elsewhere the bore's edge."""
_MOST = 0.4
"""Share of the columns that may run on: with more the edge is elsewhere."""
_SOLID = 0.7
"""A burr is a surface: of so many vertices as its reach has spacings this share is there, and of its columns
this share runs on. On burrs 0.98 and more, and all; where only the first row of another surface is seen, a
gap beyond the edge, 0.28 to 0.62; where noise of neighbours tears the edge into teeth half of the columns."""
_SURE = 0.4
"""Vertex spacings that those beyond the edge may err by, in the mean, as stated: an outline is as sharp as a
pixel, and is no news where its vertices are not. On burrs 0.01 to 0.32; 0.5 and 0.9 where a few columns had
just enough light for a rounding that the others do not show."""
_ROUNDING_MM = 3.0
"""Over so much of its end a curve's direction does not follow the rounding of an edge."""
_STEEP = 0.3
"""Sine of the angle between line of sight and surface from which an outline tells how far this reaches."""
_ASIDE = 0.5
"""Cosine of the angle around the axis, 60 degrees, up to which an end faces the camera; further on the part's
own limb and shadows end what is seen."""
_SLOPE = 1.0
"""How far, over how far it runs on, a burr may lean off the surface, or the surface off what is across the
line of sight: 45 degrees."""


class Outlined(NamedTuple):
    """The burrs that outlines show, and which of the suspects they explain."""

    burrs: list[Burr]
    explained: set[int]


class _End(NamedTuple):
    """An open end of the curve.

    Its place, the directions in which it would go on, by its last step and by its last millimetres, and the
    outward normal.
    """

    place: Floats
    ahead: Floats
    onward: Floats
    normal: Floats


def past_end(
    vertices_mm: Floats,
    axis: Axis,
    line: Polyline,
    field: Field,
    *,
    tallest_mm: float,
    sigma_mm: Floats | float | None = None,
    eye_mm: Floats | None = None,
    suspects: Mapping[int, Ints] | None = None,
) -> Outlined:
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
    sigma_mm
        Stated standard deviation of the vertices, one or (V,); None where nobody knows.
    eye_mm
        (3,) from where all of the mesh was seen, in its frame; None where nobody knows. How far the surface
        reaches is then measured across the line of sight, in which an outline is as sharp as a pixel; on a
        rounding, whose tangent turns, nothing else is.
    suspects
        Vertices of the field that lie low, by the number of their anomaly. Beside an end they may be the
        flank of a burr that leans away from where the surface would go on: then the outline is not shorter
        there, as where something is missing, but longer.

    """
    ends, found = _ends(line), Outlined([], set())
    if not ends:
        return found
    profile = profile_of(vertices_mm, axis)
    places = np.stack([profile.z_mm, profile.r_mm], axis=1)
    eye = None if eye_mm is None else placed(T_part_mesh(axis.point_mm, axis.direction), eye_mm[None])[0]
    slack = field.spacing_mm * (1.0 if eye is None else 2.0)
    sigma = np.broadcast_to(0.0 if sigma_mm is None else sigma_mm, len(places))
    for end in ends:
        away = places - end.place
        if eye is None:
            ahead, off = away @ end.ahead, away @ end.normal
            faced, leans = np.ones(len(away), np.bool_), np.maximum(ahead, 0.0)
        else:
            ahead, off, faced = _across(end, places, profile.angle, eye)
            leans = np.abs(ahead)  # the surface before the end, too
        near = faced & (ahead > -BEYOND * field.spacing_mm) & (ahead < 2.0 * tallest_mm)
        lies = np.abs(off) < slack + _SLOPE * leans
        on = near & lies
        edge = _edge(end, ahead[on], profile.angle[on], sigma[on], field, bent=eye is not None)
        if edge is None:
            continue
        before = near & ~lies & (off > 0.0) & (ahead > 0.0) & (ahead < _BEFORE * field.spacing_mm)
        if eye is not None and _hidden(edge, profile.angle[before], field):
            continue
        runs = _beyond(edge, field, tallest_mm, seen=eye is not None)
        for number, low in (suspects or {}).items():
            run = _suspected(end, edge, low, field)
            if len(run):
                found.explained.add(number)
                if not any(np.isin(run, one).any() for one in runs):
                    runs.append(run)
        found.burrs.extend(_burr(end, run, edge, axis, field) for run in runs)
    return found


def _across(end: _End, places: Floats, angle: Floats, eye: Floats) -> tuple[Floats, Floats, Bools]:
    """How far vertices are beyond an end across the line of sight and along it, and which are seen well.

    All in the meridian plane of each vertex, onto which the line of sight is projected. (V,) each.
    """
    turn = angle - np.arctan2(eye[1], eye[0])
    there = np.stack([np.full(len(turn), eye[2]), np.hypot(eye[0], eye[1]) * np.cos(turn)], axis=1)
    sight = there - places
    sight /= np.linalg.norm(sight, axis=1)[:, None]
    across = np.stack([-sight[:, 1], sight[:, 0]], axis=1)
    slant = across @ end.onward
    steep = np.abs(slant) > _STEEP
    away = places - end.place
    ahead = (away * across).sum(axis=1) / np.where(steep, slant, np.inf)
    return ahead, (away * sight).sum(axis=1), (np.cos(turn) > _ASIDE) & steep


def _ends(line: Polyline) -> list[_End]:
    found = []
    for first, last in line.pieces:
        nodes = line.nodes_mm[first : last + 1]
        if is_closed(nodes):
            continue
        for way, side in ((nodes[::-1], -1.0), (nodes, 1.0)):
            place = way[-1]
            ahead = (place - way[-2]) / np.linalg.norm(place - way[-2])
            far = way[np.linalg.norm(way - place, axis=1) > _ROUNDING_MM]
            onward = place - (far[-1] if len(far) else way[0])
            normal = side * np.array([-ahead[1], ahead[0]])
            found.append(_End(place, ahead, onward / np.linalg.norm(onward), normal))
    return found


class _Edge(NamedTuple):
    """How much further than usual each column of an end reaches (NaN: not known), and the radius there.

    With the number of vertices in each column that lie further than usual, the sum of what they may err by,
    and which columns tell what is usual.
    """

    off_mm: Floats
    radius_mm: float
    vertices: Ints
    doubt_mm: Floats
    usual: Bools

    @property
    def scatter_mm(self) -> float:
        """Robust standard deviation of what is usual."""
        return SIGMA_PER_MEDIAN * float(np.nanmedian(np.abs(self.off_mm[self.usual])))


def _columns(angle: Floats, columns: int, field: Field) -> Ints:
    """Which of so many columns of the field's arc angles are in."""
    turn = (angle - field.arc[0]) % (2.0 * np.pi) / field.arc[1]
    return np.minimum((turn * columns).astype(np.int64), columns - 1)


def _edge(
    end: _End, ahead: Floats, angle: Floats, sigma: Floats, field: Field, *, bent: bool
) -> _Edge | None:
    """The straight edge of an end; None where it has none."""
    radius = max(float(end.place[1]), field.spacing_mm)
    columns = max(int(field.arc[1] * radius / field.spacing_mm), 1)
    column = _columns(angle, columns, field)
    reach = reach_of(ahead, column, columns, spacing_mm=field.spacing_mm)
    known = np.isfinite(reach)
    if np.count_nonzero(known) < FEWEST:
        return None
    stepped = between_steps(reach / field.spacing_mm, known) if bent else np.zeros(columns, np.bool_)
    tell = known & ~stepped
    if np.count_nonzero(tell) < FEWEST:
        return None
    usual = usual_reach(reach, tell, field.spacing_mm / np.sqrt(12.0), bent=bent)
    off = np.where(known, reach - usual, np.nan)
    if np.mean(np.abs(off[tell]) < field.spacing_mm) < _STRAIGHT:
        return None
    on = (ahead > usual[column]) & (ahead <= reach[column])
    doubt = np.bincount(column[on], sigma[on], minlength=columns).astype(float)
    return _Edge(off, radius, np.bincount(column[on], minlength=columns), doubt, tell)


def _hidden(edge: _Edge, before: Floats, field: Field) -> bool:
    """Whether the surface ends where something hides it, which is at the angles ``before`` it."""
    columns = len(edge.off_mm)
    hides = np.zeros(columns, dtype=np.bool_)
    hides[_columns(before, columns, field)] = True
    return bool(np.mean(hides[np.isfinite(edge.off_mm)]) > _MOSTLY)


def _beyond(edge: _Edge, field: Field, tallest_mm: float, *, seen: bool) -> list[Ints]:
    """The columns that go on where most end, in runs; without the gaps within them."""
    off, radius, columns = edge.off_mm, edge.radius_mm, len(edge.off_mm)
    windows = WINDOWS_SEEN if seen else WINDOWS
    beyond = further(off / field.spacing_mm, windows, usual=edge.usual, closed=field.closed)
    if np.count_nonzero(beyond & edge.usual) > _MOST * np.count_nonzero(edge.usual):
        return []
    found = []
    for run in runs_of(beyond, closed=field.closed):
        on = run[beyond[run % columns]]
        high = off[on % columns]
        if len(high) < _LEAST_COLUMNS or high.max() >= tallest_mm:
            continue
        low = np.quantile(high, _TALL) < min(len(run) * field.arc[1] / columns, _ROUND) * radius
        if low and _solid(edge, run, on, field) and steps_out(off, run, closed=field.closed):
            found.append(on)
    return found


def _solid(edge: _Edge, run: Ints, on: Ints, field: Field) -> bool:
    """Whether there is surface, and known, to where the columns of a run reach, and in most of them."""
    within = run % len(edge.off_mm)
    far = float(np.nansum(np.maximum(edge.off_mm[within], 0.0))) / field.spacing_mm
    there = int(edge.vertices[within].sum())
    full = there >= _SOLID * far and float(edge.doubt_mm[within].sum()) <= _SURE * field.spacing_mm * there
    return full and len(on) >= _SOLID * int(np.count_nonzero(np.isfinite(edge.off_mm[within])))


def _suspected(end: _End, edge: _Edge, on: Ints, field: Field) -> Ints:
    """The columns of the burr of which what lies low beside an end is the flank; none if it is none's."""
    aside = np.linalg.norm(field.foot[on] - end.place, axis=1)
    if float(np.median(aside)) > _BESIDE * field.spacing_mm:
        return on[:0]
    columns = len(edge.off_mm)
    at = np.unique(_columns(field.angle[on], columns, field))
    run = np.arange(at[0], at[-1] + 1)
    if not runs_on(edge.off_mm / field.spacing_mm, run, closed=field.closed):
        return on[:0]
    return run[np.isfinite(edge.off_mm[run])]


def _burr(end: _End, run: Ints, edge: _Edge, axis: Axis, field: Field) -> Burr:
    """A burr of which an outline is known: its length and its height, and nothing of its width."""
    radius, scatter = edge.radius_mm, edge.scatter_mm
    high = edge.off_mm[run % len(edge.off_mm)]
    step = field.arc[1] / len(edge.off_mm)
    angle = field.arc[0] + (0.5 * (run[0] + run[-1]) + 0.5) * step
    angle = turn_rad(angle)
    tall = float(np.quantile(high, _TALL))
    sigma = float(np.hypot(field.spacing_mm / np.sqrt(12.0), scatter))
    z = sorted((float(end.place[0]), float(end.place[0] + tall * end.ahead[0])))
    length = (run[-1] - run[0] + 1) * step * radius
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
