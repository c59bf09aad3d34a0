"""From a part of a wheel's surface to the Mitsuba plugins that reflect as it does.

A blemish is a blend of two reflections by a small texture of its own, laid over the wheel's (u, v) by an
affine map: its edges are as sharp as that texture, whatever the facets. The textures are filled from
:mod:`scenes.surface.cover`, which the truth reads too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from burrscan.arrays import Floats
from scenes.finish import Channels, FinishSpec, diffuse_bsdf, one_sided_bsdf, torn, two_sided
from scenes.surface.cover import cover_of, cover_of_patch, cover_of_scratch
from scenes.surface.parts import Cover, SurfacePart
from scenes.surface.spec import BrightSpot, Chatter, Scratch, Stain

_PATCH = 512
"""Texels along each side of a stain's or spot's texture: the rim's 8 % is then twenty texels wide."""
_ALONG, _ACROSS = 512, 96
"""Texels of a scratch's cover: its length and its much smaller width."""
_GROOVE = 192
"""Square, for Mitsuba 3.9 scales a turned texture's gradient by the resolution of the wrong side."""
_BAND = 512
"""Texels across a band of chatter."""
_ARC = 1024
"""Texels round an arc of chatter, whose two ends are feathered; a whole turn has no ends and needs two."""
_WAVE = 64
"""Texels per wave of chatter: its slope is interpolated between them."""
_MARGIN = 1.1
"""Texture box over extent: the texture is nothing at its border, where clamping repeats it."""
_WIDE_MARGIN = 1.5
"""The same across a scratch, which has few texels there."""


def part_bsdf(mi: Any, part: SurfacePart, *, channels: Channels) -> dict[str, Any]:
    """The plugin dictionary of a part, two-sided.

    Parameters
    ----------
    mi
        The activated Mitsuba module.
    part, channels
        What it is; as in :func:`scenes.finish.finish_bsdf`.

    """
    bsdf = one_sided_bsdf(part.finish, channels=channels, mi=mi)
    for cover in part.covers:
        bsdf = {
            "type": "blendbsdf",
            "weight": _weight(mi, cover, part.outline_mm),
            "bsdf_0": bsdf,
            "bsdf_1": _covered(mi, cover, part, channels),
        }
    return two_sided(bsdf)


def _covered(mi: Any, cover: Cover, part: SurfacePart, channels: Channels) -> dict[str, Any]:
    """What the surface reflects where the blemish covers it wholly."""
    blemish = cover.blemish
    if isinstance(blemish, Stain):
        return diffuse_bsdf(blemish.reflectance)
    if isinstance(blemish, BrightSpot):
        spot = blemish.finish.on(part.finish) if blemish.finish else part.finish
        return one_sided_bsdf(spot, channels=channels, mi=mi)
    if isinstance(blemish, Scratch):
        inside = blemish.finish.on(part.finish) if blemish.finish else torn(part.finish)
        return _bumped(
            one_sided_bsdf(inside, channels=channels, mi=mi), _groove(mi, cover, blemish, part.outline_mm)
        )
    rough = one_sided_bsdf(_rougher(part.finish, blemish.roughness), channels=channels, mi=mi)
    return _bumped(rough, _ripple(mi, cover, blemish))


def _rougher(finish: FinishSpec, factor: float) -> FinishSpec:
    along, across, even = (
        float(np.clip(alpha * factor, 0.01, 1.0))
        for alpha in (finish.alpha_along, finish.alpha_across, finish.alpha)
    )
    return replace(finish, alpha=even, alpha_along=along, alpha_across=across)


def _bumped(bsdf: dict[str, Any], heights: dict[str, Any]) -> dict[str, Any]:
    """Normals turned as those of a surface raised by ``heights``, mm."""
    return {"type": "bumpmap", "heights": heights, "bsdf": bsdf}


def _weight(mi: Any, cover: Cover, outline_mm: float) -> dict[str, Any]:
    """The texture of how much of the surface the blemish covers."""
    blemish, half = cover.blemish, cover.place.half_mm
    if isinstance(blemish, Scratch):
        box = (blemish.length_mm / 2.0 * _MARGIN, blemish.width_mm / 2.0 * _WIDE_MARGIN)
        values = _sampled(lambda *at: cover_of_scratch(blemish, *at), box, (_ALONG, _ACROSS))
        return _texture(mi, values, _boxed(_scratch_map(cover, blemish, outline_mm), box))
    box = (half[0] * _MARGIN, half[1] * _MARGIN)
    if isinstance(blemish, Chatter):
        size = (2 if cover.place.whole_turn else _ARC, _BAND)
        values = _sampled(lambda x, y: cover_of(blemish, x, y, half), box, size)
        matrix = _boxed(_local_map(cover, outline_mm), box)
        return _texture(mi, values, matrix)
    values = _sampled(lambda x, y: cover_of_patch(blemish, x, y), box, (_PATCH, _PATCH))
    if isinstance(blemish, Stain):
        values *= blemish.cover
    return _texture(mi, values, _boxed(_local_map(cover, outline_mm), box))


def _groove(mi: Any, cover: Cover, scratch: Scratch, outline_mm: float) -> dict[str, Any]:
    """Heights of a scratch: a cosine across it, the same along it."""
    half = scratch.width_mm / 2.0
    box = (scratch.length_mm, half * _WIDE_MARGIN)
    depth_mm = scratch.depth_um * 1e-3
    values = _sampled(
        lambda _, across: np.where(
            np.abs(across) < half, -depth_mm * (1.0 + np.cos(np.pi * across / half)) / 2.0, 0.0
        ),
        box,
        (_GROOVE, _GROOVE),
    )
    return _texture(mi, values, _boxed(_scratch_map(cover, scratch, outline_mm), box))


def _ripple(mi: Any, cover: Cover, chatter: Chatter) -> dict[str, Any]:
    """Heights of a wave, repeated a whole number of times round the wheel."""
    waves = max(1, round(2.0 * np.pi * cover.place.radius_mm / chatter.wavelength_mm))
    phase = (np.arange(_WAVE) + 0.5) / _WAVE
    values = np.tile(np.cos(2.0 * np.pi * phase) * chatter.height_um * 0.5e-3, (2, 1))
    matrix = np.array([[float(waves), 0.0, 0.0], [0.0, 0.0, 0.5], [0.0, 0.0, 1.0]])
    return _texture(mi, values, matrix, repeated=True)


def _local_map(cover: Cover, outline_mm: float) -> Floats:
    """(3, 3) from (u, v, 1) to millimetres about the blemish's middle."""
    place = cover.place
    round_mm = 2.0 * np.pi * place.radius_mm
    middle = cover.turns + place.angle_deg / 360.0
    return np.array(
        [[round_mm, 0.0, -round_mm * middle], [0.0, outline_mm, -place.walked_mm], [0.0, 0.0, 1.0]]
    )


def _scratch_map(cover: Cover, scratch: Scratch, outline_mm: float) -> Floats:
    """(3, 3) from (u, v, 1) to millimetres along and across a scratch."""
    c, s = np.cos(np.radians(scratch.direction_deg)), np.sin(np.radians(scratch.direction_deg))
    turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(turn @ _local_map(cover, outline_mm))


def _boxed(local: Floats, box_mm: tuple[float, float]) -> Floats:
    """A map to millimetres carried on to the texture's (0, 1) over a box of these half sizes."""
    scale = np.array([[0.5 / box_mm[0], 0.0, 0.5], [0.0, 0.5 / box_mm[1], 0.5], [0.0, 0.0, 1.0]])
    return np.asarray(scale @ local)


def _sampled(
    values: Callable[[Floats, Floats], Floats], box_mm: tuple[float, float], size: tuple[int, int]
) -> Floats:
    """(rows, columns) a function of two lengths at the texels' middles."""
    (a, b), (columns, rows) = box_mm, size
    x = (2.0 * (np.arange(columns) + 0.5) / columns - 1.0) * a
    y = (2.0 * (np.arange(rows) + 0.5) / rows - 1.0) * b
    return np.asarray(values(*np.meshgrid(x, y)), float)


def _texture(mi: Any, values: Floats, uv_map: Floats, *, repeated: bool = False) -> dict[str, Any]:
    """A bitmap over the mesh's (u, v); rows run along the map's second coordinate."""
    return {
        "type": "bitmap",
        "bitmap": mi.Bitmap(np.ascontiguousarray(values[..., None], np.float32)),
        "raw": True,
        "filter_type": "bilinear",
        "wrap_mode": "repeat" if repeated else "clamp",
        "to_uv": mi.ScalarTransform3f(uv_map),
    }
