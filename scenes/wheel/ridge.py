"""Burrs and nicks parallel to the axis, on the outermost surface."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats
from burrscan.errors import InputError
from scenes.wheel.envelope import offset_radius, outer_radius
from scenes.wheel.outline import Outline
from scenes.wheel.spec import AxialRidge, Nick
from scenes.wheel.tool import OVERLAP_MM, SINK_MM, Tool, varying_heights
from scenes.wheel.truth import deviation_mm

_STATION_MM = 0.25
_BESIDE_MM = 1e-4
_LIMIT_MM = 1e-6
_LONGEST_ONWARD = 0.25
_REFINEMENTS = 8
_SHARES = (0.25, 0.5, 0.75)
_EXCESS_MM = 2e-4


def ridge_tool(burr: AxialRidge, outline: Outline) -> Tool:
    """The solid of a ridge: at each station a triangle of the base width with its apex at the height.

    The crest is the curve at the height's distance from the wheel (:func:`offset_radius`), so that the height
    along the surface normal is exact on cylinders, cones and fillets and never exceeded at steps.

    Raises
    ------
    InputError
        When the ridge's extent is empty or reaches beyond the wheel.

    """
    z = _stations(outline, burr.z_start_mm, burr.z_end_mm, kind=burr.kind)
    if not np.isfinite(outer_radius(outline, _just_inside(z))).all():
        ends = outline.curve_zr[:, 0]
        raise InputError(
            f"{burr.kind}: z {burr.z_start_mm:g} to {burr.z_end_mm:g} mm reaches beyond the wheel "
            f"({ends.min():g} to {ends.max():g} mm)"
        )
    z = _refined(z, outline, burr.height_mm)
    just_inside = _just_inside(z)
    base = outer_radius(outline, just_inside)
    heights = varying_heights(z, height_mm=burr.height_mm, variation=burr.height_variation, seed=burr.seed)
    apex = offset_radius(outline, just_inside, heights)
    root = _lowest_beside(base) - SINK_MM
    sideways = heights * np.tan(np.radians(burr.lean_deg))
    stations = _rings(z, apex, base, root, sideways, half_width=burr.width_mm / 2.0, turn=1.0)
    return _tool(burr, _turned(stations, burr.angle_deg), width_mm=burr.width_mm, base=base)


def nick_tool(nick: Nick, outline: Outline) -> Tool:
    """The solid that cuts a nick: a V with its bottom at the depth, reaching out of the wheel.

    Raises
    ------
    InputError
        When the nick's extent is empty or misses the wheel.

    """
    z = _stations(outline, nick.z_start_mm, nick.z_end_mm, kind=nick.kind)
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
    upright = np.zeros_like(z)
    open_z = _run_out(z, base, outline)
    stations = _rings(open_z, apex, base, root, upright, half_width=half_width, turn=-1.0)
    return _tool(nick, _turned(stations, nick.angle_deg), width_mm=nick.width_mm, base=base)


def _stations(outline: Outline, start_mm: float, end_mm: float, *, kind: str) -> Floats:
    """Evenly spaced positions, and a pair close to each sharp step of the outline."""
    if not start_mm < end_mm:
        raise InputError(f"{kind}: z_start_mm {start_mm:g} must be less than z_end_mm {end_mm:g}")
    even = np.linspace(start_mm, end_mm, int(np.ceil((end_mm - start_mm) / _STATION_MM)) + 1)
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
    z: Floats, apex: Floats, base: Floats, root: Floats, sideways: Floats, *, half_width: float, turn: float
) -> Floats:
    """(N, 5, 3) apex, base, root, root, base about angle 0; ``turn`` keeps the ring's sense for nicks."""
    if half_width >= base.min():
        raise InputError(f"a burr {2 * half_width:g} mm wide does not fit a radius of {base.min():g} mm")
    a = _polar(apex, np.arcsin(np.clip(sideways / apex, -1.0, 1.0)), z)
    # the flanks pass through the base points on the surface and run on a little
    onward = np.minimum(OVERLAP_MM / np.abs(apex - base), _LONGEST_ONWARD)
    sides = []
    for sign in (turn, -turn):
        b = _polar(base, np.arcsin(sign * half_width / base), z)
        b = b + (b - a) * onward[:, None]
        angle, radius = np.arctan2(b[:, 1], b[:, 0]), np.hypot(b[:, 0], b[:, 1])
        # a flank so flat that it grazes the surface is led through it
        through = turn * np.minimum(turn * radius, turn * base - OVERLAP_MM / 2.0)
        sides.append((_polar(through, angle, z), _polar(root, angle, z)))
    (b0, c0), (b1, c1) = sides
    return np.stack([a, b0, c0, c1, b1], axis=1)


def _polar(radius: Floats, angle: Floats, z: Floats) -> Floats:
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=-1)


def _turned(points: Floats, angle_deg: float) -> Floats:
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    rotation = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(points @ rotation)


def _tool(burr: AxialRidge | Nick, stations: Floats, *, width_mm: float, base: Floats) -> Tool:
    return Tool(
        stations_mm=stations,
        side="nick" if isinstance(burr, Nick) else "protrusion",
        angle_deg=burr.angle_deg,
        z_start_mm=burr.z_start_mm,
        z_end_mm=burr.z_end_mm,
        width_mm=width_mm,
        length_mm=burr.z_end_mm - burr.z_start_mm,
        arc_deg=float(np.degrees(2.0 * np.arcsin(width_mm / 2.0 / base.min()))),
    )
