"""How much of the surface a blemish covers at each point: one definition for its picture and its truth."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats
from scenes.surface.spec import Blemish, BrightSpot, Chatter, Scratch, Stain

_FEATHER = 0.08
"""Width of the rim over the radius, across which the cover rises: a sharp rim would alias in the texture."""
_HARMONICS = np.arange(2, 7)
"""Of the rim's outline: the first would shift it, higher ones than the sixth make teeth."""
_SPARE = 1.02
"""On the largest radius: the rim is sampled at half degrees, and its true maximum lies between."""


def half_extent_mm(blemish: Stain | BrightSpot | Scratch) -> tuple[float, float]:
    """Half of the extent along the circumference and along the outline."""
    if isinstance(blemish, Scratch):
        c, s = (
            np.abs(np.cos(np.radians(blemish.direction_deg))),
            np.abs(np.sin(np.radians(blemish.direction_deg))),
        )
        long, wide = blemish.length_mm / 2.0, blemish.width_mm / 2.0
        return float(c * long + s * wide), float(s * long + c * wide)
    largest = float(rim(blemish, np.linspace(0.0, 2.0 * np.pi, 721)).max()) * _SPARE * (1.0 + _FEATHER / 2.0)
    return blemish.width_mm / 2.0 * largest, blemish.length_mm / 2.0 * largest


def rim(blemish: Stain | BrightSpot, angle: Floats) -> Floats:
    """The rim's radius over the ellipse's, at angles about the middle."""
    phases = np.random.default_rng(blemish.seed).uniform(0.0, 2.0 * np.pi, len(_HARMONICS))
    waves = np.cos(angle[..., None] * _HARMONICS + phases).sum(axis=-1)
    return np.asarray(1.0 + blemish.waviness * np.sqrt(2.0 / len(_HARMONICS)) * waves)


def cover_of_patch(blemish: Stain | BrightSpot, x_mm: Floats, y_mm: Floats) -> Floats:
    """0 outside to 1 inside, over a rim of 8 % of the radius."""
    x, y = x_mm / (blemish.width_mm / 2.0), y_mm / (blemish.length_mm / 2.0)
    inside = rim(blemish, np.arctan2(y, x)) - np.hypot(x, y)
    return np.asarray(np.clip(inside / _FEATHER + 0.5, 0.0, 1.0))


def cover_of(blemish: Blemish, x_mm: Floats, y_mm: Floats, half_mm: tuple[float, float]) -> Floats:
    """Share covered at x along the circumference and y along the outline, mm from the blemish's middle."""
    if isinstance(blemish, Scratch):
        return cover_of_scratch(blemish, *scratch_frame(blemish, x_mm, y_mm))
    if isinstance(blemish, Chatter):
        round_it = np.abs(x_mm) <= (np.inf if blemish.arc_deg == 360 else half_mm[0])
        return np.where(round_it & (np.abs(y_mm) <= half_mm[1]), 1.0, 0.0)
    return cover_of_patch(blemish, x_mm, y_mm)


def cover_of_scratch(scratch: Scratch, along_mm: Floats, across_mm: Floats) -> Floats:
    """1 in the scratch, 0 beside it, at positions along and across it."""
    inside = (np.abs(along_mm) <= scratch.length_mm / 2.0) & (np.abs(across_mm) <= scratch.width_mm / 2.0)
    return np.where(inside, 1.0, 0.0)


def scratch_frame(blemish: Scratch, x_mm: Floats, y_mm: Floats) -> tuple[Floats, Floats]:
    """Positions along and across a scratch."""
    c, s = np.cos(np.radians(blemish.direction_deg)), np.sin(np.radians(blemish.direction_deg))
    return c * x_mm + s * y_mm, c * y_mm - s * x_mm
