"""Ramps: pictures of an evenly lit board at a series of exposures or of projector levels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from burrscan.arrays import Bools, Floats, Image, Ints, freeze
from burrscan.errors import InputError

_TILES = 12
"""Along the shorter side: an uneven light hardly changes within one, and each still averages many pixels."""
_LEAST_TILE_PX = 4
"""A side: sixteen pixels give twelve differences of neighbours to tell the noise by."""
_CLEAR = 4.0
"""Standard deviations from the ends of the range; to refuse clipped pixels would choose tiles by noise."""


@dataclass(frozen=True)
class ExposureRamp:
    """Pictures under one steady lamp at many exposures.

    Parameters
    ----------
    images
        (F, h, w) or (F, h, w, 3) DN of the board alone.
    exposures_ms
        (F,).
    lit
        (F,) False where the lamp is off: what remains is the surround. At least one such picture takes the
        surround off a crosstalk matrix; a response curve needs none.

    """

    images: Image
    exposures_ms: Floats
    lit: Bools

    def __post_init__(self) -> None:
        _check(self.images, self.exposures_ms, self.lit)
        freeze(self, images=self.images, exposures_ms=self.exposures_ms, lit=self.lit)


@dataclass(frozen=True)
class LevelRamp:
    """Pictures under the projector at many levels.

    Parameters
    ----------
    images
        (F, h, w) or (F, h, w, 3) DN of the board alone.
    exposures_ms
        (F,); more than one exposure lifts the dark levels out of the noise.
    levels
        (F, primaries) even levels 0 .. 255 shown; -1 in all of them where the projector is off or covered,
        which tells its black level from the surround. Each primary is ramped with the others at 0, and needs
        255 and 0 among its levels.

    """

    images: Image
    exposures_ms: Floats
    levels: Ints

    def __post_init__(self) -> None:
        _check(self.images, self.exposures_ms, self.levels)
        freeze(self, images=self.images, exposures_ms=self.exposures_ms, levels=self.levels)


class Tiles(NamedTuple):
    """Means of a ramp over tiles, their sigma, the pixels' variance, and which are unclipped.

    All (F, tiles, channels).
    """

    dn: Floats
    sigma_dn: Floats
    variance_dn2: Floats
    usable: Bools


def tiles_of(images: Image, *, saturation_dn: int) -> Tiles:
    """Average a ramp's pictures over some 12 × 12 tiles. O(pixels · frames).

    The noise comes from differences of neighbouring pixels, which an uneven light hardly moves. Where it is
    far below one DN it no longer dithers the rounding, whose share of the error then stays however many
    pixels are averaged: ``1 / (2 π²) exp(-4 π² σ²)`` DN² (the first harmonic of its sawtooth).
    """
    frames, height, width = images.shape[:3]
    side = max(_LEAST_TILE_PX, min(height, width) // _TILES)
    down, across = height // side, width // side
    if down * across < 1:
        raise InputError(f"a ramp of {width}×{height} pixels: at least {_LEAST_TILE_PX} each way are needed")
    cut = images[:, : down * side, : across * side].reshape(frames, down, side, across, side, -1)
    tiled = cut.transpose(0, 1, 3, 5, 2, 4).reshape(frames, down * across, -1, side, side)
    steps = np.diff(tiled.astype(np.float32), axis=-1)
    variance = 0.5 * (steps**2).mean(axis=(-1, -2), dtype=float)
    dn = tiled.mean(axis=(-1, -2), dtype=float)
    clear = _CLEAR * np.sqrt(variance) + 1.0
    rounding = np.exp(-4.0 * np.pi**2 * variance) / (2.0 * np.pi**2)
    return Tiles(
        dn=dn,
        sigma_dn=np.sqrt(np.maximum(variance, 1.0 / 12.0) / side**2 + rounding),
        variance_dn2=variance,
        usable=(dn + clear < saturation_dn) & (dn - clear > 0.0),
    )


def ramp_exposures_ms(longest_ms: float, *, octaves: float = 9.0) -> Floats:
    """36 exposures for a ramp up to ``longest_ms``, which should just clip.

    A third goes down by octaves, a third is even, a third lies close below the clipping, to which the curve
    is scaled.
    """
    even = np.linspace(longest_ms / 12.0, longest_ms, 12)
    top = np.linspace(0.72, 1.0, 12, endpoint=False) * longest_ms
    octave = longest_ms * 2.0 ** -np.linspace(0.5, octaves, 12)
    return np.sort(np.concatenate([even, top, octave]))


def _check(images: Image, exposures_ms: Floats, marks: Bools | Ints) -> None:
    if images.ndim not in {3, 4} or not len(images) == len(exposures_ms) == len(marks):
        raise InputError(
            f"a ramp's pictures {images.shape}, exposures {exposures_ms.shape} and marks {marks.shape} do "
            "not belong together: one exposure and one mark per picture"
        )
    if not (np.isfinite(exposures_ms) & (exposures_ms > 0.0)).all():
        raise InputError("a ramp's exposures must be above zero")
