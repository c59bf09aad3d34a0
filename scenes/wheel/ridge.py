"""Burrs and nicks parallel to the axis, on the outermost surface."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats
from burrscan.errors import InputError
from scenes.wheel.course import course_of, station_step_mm, varying_heights, whole_pieces
from scenes.wheel.envelope import offset_radius, outer_radius
from scenes.wheel.outline import Outline
from scenes.wheel.section import Section, prism, section_of
from scenes.wheel.spec import AxialRidge, Nick
from scenes.wheel.tool import (
    LONGEST_ONWARD,
    OVERLAP_MM,
    SINK_MM,
    Tool,
    mean_thickness_mm,
    piece_stations,
    ring_smooth,
)
from scenes.wheel.truth import deviation_mm

_STATION_MM = 0.25
"""Between cross-sections along the axis: small against any fillet of a wheel; kinks get their own."""
_BESIDE_MM = 1e-4
"""Distance of a pair of stations to either side of a step of the outline."""
_LIMIT_MM = 1e-6
"""A nanometre inwards, where an end lies exactly on a step."""
_REFINEMENTS = 8
"""Halvings of a station's step at most: from 0.25 mm to a micrometre."""
_SHARES = (0.25, 0.5, 0.75)
"""Of a chord, at which its distance from the wheel is looked at."""
_EXCESS_MM = 2e-4
"""By which a chord of the crest may be farther from the wheel than the burr is high."""


def ridge_tool(burr: AxialRidge, outline: Outline) -> Tool:
    """The solid of a ridge: at each station its section, wrapped onto the wheel.

    The crest is the curve at the height's distance from the wheel (:func:`offset_radius`), so that the height
    along the surface normal is exact on cylinders, cones and fillets and never exceeded at steps. Points
    below it lie in proportion between the wheel's radius and the crest's.

    Raises
    ------
    InputError
        When the ridge's extent is empty or reaches beyond the wheel, or its section is impossible.

    """
    step_mm = station_step_mm(burr, _STATION_MM)
    z = _stations(outline, burr.z_start_mm, burr.z_end_mm, kind=burr.kind, step_mm=step_mm)
    if not np.isfinite(outer_radius(outline, _just_inside(z))).all():
        ends = outline.curve_zr[:, 0]
        raise InputError(
            f"{burr.kind}: z {burr.z_start_mm:g} to {burr.z_end_mm:g} mm reaches beyond the wheel "
            f"({ends.min():g} to {ends.max():g} mm)"
        )
    pieces_mm = whole_pieces(burr, burr.z_end_mm - burr.z_start_mm)
    z = np.union1d(_refined(z, outline, burr.height_mm), burr.z_start_mm + pieces_mm[1:, 0])
    z = np.union1d(z, burr.z_start_mm + pieces_mm[:-1, 1])
    just_inside = _just_inside(z)
    base = outer_radius(outline, just_inside)
    course = course_of(burr, z - z[0], pieces_mm)
    section = section_of(burr, course)
    apex = offset_radius(outline, just_inside, course.heights_mm)
    root = _lowest_beside(base) - SINK_MM
    stations = _rings(z, section, course.heights_mm, apex, base, root, turn=1.0)
    pieces = piece_stations(z - z[0], pieces_mm)
    return _tool(burr, _turned(stations, burr.angle_deg), section, z=z, base=base, pieces=pieces)


def nick_tool(nick: Nick, outline: Outline) -> Tool:
    """The solid that cuts a nick: a V with its bottom at the depth, reaching out of the wheel.

    Raises
    ------
    InputError
        When the nick's extent is empty or misses the wheel.

    """
    z = _stations(outline, nick.z_start_mm, nick.z_end_mm, kind=nick.kind, step_mm=_STATION_MM)
    ends = outline.curve_zr[:, 0].min(), outline.curve_zr[:, 0].max()
    if nick.z_end_mm <= ends[0] or nick.z_start_mm >= ends[1]:
        raise InputError(f"nick: z {nick.z_start_mm:g} to {nick.z_end_mm:g} mm misses the wheel")
    z = _refined(z, outline, -nick.depth_mm)
    inside = np.clip(_just_inside(z), *ends)
    base = outer_radius(outline, inside)
    depths = varying_heights(z, height_mm=nick.depth_mm, variation=nick.depth_variation, seed=nick.seed)
    apex = offset_radius(outline, inside, -depths)
    if (apex <= 0.0).any():
        raise InputError(f"nick: a depth of {nick.depth_mm:g} mm reaches the axis")
    half_width = nick.width_mm / 2.0
    # the tool's outer side is a chord: raised by its sagitta it clears the bottom of the flattest nick
    root = -_lowest_beside(-base) + SINK_MM + 2.0 * half_width**2 / base
    open_z = _run_out(z, base, outline)
    section = prism(half_width, depths)
    stations = _rings(open_z, section.reversed(), depths, apex, base, root, turn=-1.0)
    pieces = ((0, len(z) - 1),)
    return _tool(nick, _turned(stations, nick.angle_deg), section, z=z, base=base, pieces=pieces)


def _stations(outline: Outline, start_mm: float, end_mm: float, *, kind: str, step_mm: float) -> Floats:
    """Evenly spaced positions, and a pair close to each sharp step of the outline."""
    if not start_mm < end_mm:
        raise InputError(f"{kind}: z_start_mm {start_mm:g} must be less than z_end_mm {end_mm:g}")
    even = np.linspace(start_mm, end_mm, int(np.ceil((end_mm - start_mm) / step_mm)) + 1)
    corners = outline.vertices_zr[:, 0]
    pairs = np.concatenate([corners - _BESIDE_MM, corners + _BESIDE_MM])
    z = np.unique(np.concatenate([even, pairs[(pairs > start_mm) & (pairs < end_mm)]]))
    keep = np.concatenate([[True], np.diff(z) > _BESIDE_MM / 2.0])
    keep[-1] = True
    return np.asarray(z[keep])


def _refined(z: Floats, outline: Outline, distance_mm: float) -> Floats:
    """More stations where the chord of the crest would be too far from the wheel, as at its kinks."""
    ends = outline.curve_zr[:, 0].min(), outline.curve_zr[:, 0].max()
    for _ in range(_REFINEMENTS):
        inside = np.clip(_just_inside(z), *ends)
        radius = offset_radius(outline, inside, np.full(len(z), distance_mm))
        crest = np.stack([radius, np.zeros_like(radius), inside], axis=1)
        chords = np.concatenate([crest[:-1] * (1.0 - share) + crest[1:] * share for share in _SHARES])
        deviation = deviation_mm(chords, outline.curve_zr).reshape(len(_SHARES), -1)
        excess = np.max(deviation * np.sign(distance_mm), axis=0) - abs(distance_mm)
        poor = (excess > _EXCESS_MM) & (np.diff(z) > 2.0 * _BESIDE_MM)
        if not poor.any():
            break
        z = np.union1d(z, ((z[:-1] + z[1:]) / 2.0)[poor])
    return z


def _just_inside(z: Floats) -> Floats:
    """The positions, both ends a nanometre inwards: at a step they belong to the burr's side of it."""
    return np.clip(z, z[0] + _LIMIT_MM, z[-1] - _LIMIT_MM)


def _run_out(z: Floats, base: Floats, outline: Outline) -> Floats:
    """An end at which the wheel drops goes on a little: the nick is open there, with no film left."""
    moved = z.copy()
    for end, step in ((0, -OVERLAP_MM), (-1, OVERLAP_MM)):
        beyond = outer_radius(outline, z[[end]] + step)[0]
        if not beyond >= base[end] - OVERLAP_MM:
            moved[end] += step
    return moved


def _lowest_beside(values: Floats) -> Floats:
    padded = np.pad(values, 1, mode="edge")
    return np.asarray(np.minimum(np.minimum(padded[:-2], padded[2:]), values))


def _rings(
    z: Floats, section: Section, heights: Floats, apex: Floats, base: Floats, root: Floats, *, turn: float
) -> Floats:
    """(N, K + 2, 3) the section, its ends led through the surface, and the root, about angle 0.

    A nick's section comes reversed, with ``turn`` = -1, which keeps the ring's sense.
    """
    x, share = section.points_mm[..., 0], section.points_mm[..., 1] / heights[:, None]
    widest = float(np.ptp(x[:, [0, -1]], axis=1).max())
    if widest >= 2.0 * base.min():
        raise InputError(f"a burr {widest:g} mm wide does not fit a radius of {base.min():g} mm")
    radius = base[:, None] + (apex - base)[:, None] * share
    flanks = _polar(radius, np.arcsin(np.clip(x / radius, -1.0, 1.0)), z[:, None])
    (first, first_root), (last, last_root) = (
        _led_through(flanks[:, end], flanks[:, beside], radius[:, beside], z, base, root, turn=turn)
        for end, beside in ((0, 1), (-1, -2))
    )
    ring = [first[:, None], flanks[:, 1:-1], last[:, None], last_root[:, None], first_root[:, None]]
    return np.concatenate(ring, axis=1)


def _led_through(
    end: Floats, beside: Floats, beside_radius: Floats, z: Floats, base: Floats, root: Floats, *, turn: float
) -> tuple[Floats, Floats]:
    """The flank's end on the surface run on a little through it, and the root below that."""
    onward = np.minimum(OVERLAP_MM / np.abs(beside_radius - base), LONGEST_ONWARD)
    led = end + (end - beside) * onward[:, None]
    angle, radius = np.arctan2(led[:, 1], led[:, 0]), np.hypot(led[:, 0], led[:, 1])
    # a flank so flat that it grazes the surface is led through it
    through = turn * np.minimum(turn * radius, turn * base - OVERLAP_MM / 2.0)
    return _polar(through, angle, z), _polar(root, angle, z)


def _polar(radius: Floats, angle: Floats, z: Floats) -> Floats:
    return np.stack(np.broadcast_arrays(radius * np.cos(angle), radius * np.sin(angle), z), axis=-1)


def _turned(points: Floats, angle_deg: float) -> Floats:
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    rotation = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(points @ rotation)


def _tool(
    burr: AxialRidge | Nick,
    stations: Floats,
    section: Section,
    *,
    z: Floats,
    base: Floats,
    pieces: tuple[tuple[int, int], ...],
) -> Tool:
    width_mm = float(np.ptp(section.points_mm[:, [0, -1], 0], axis=1).max())
    return Tool(
        stations_mm=stations,
        smooth=ring_smooth(section),
        pieces=pieces,
        position_mm=z - z[0],
        thickness_mm=mean_thickness_mm(section),
        side="nick" if isinstance(burr, Nick) else "protrusion",
        angle_deg=burr.angle_deg,
        z_start_mm=burr.z_start_mm,
        z_end_mm=burr.z_end_mm,
        width_mm=width_mm,
        length_mm=burr.z_end_mm - burr.z_start_mm,
        arc_deg=float(np.degrees(2.0 * np.arcsin(width_mm / 2.0 / base.min()))),
    )
