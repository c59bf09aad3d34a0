"""What changes from picture to picture: the projector's brightness and where both devices point."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field
from scipy import ndimage

from burrscan.arrays import Floats, Floats32
from burrscan.documents import STRICT
from scenes.streams import stream_key

NotNegative = Annotated[float, Field(ge=0.0)]


@dataclass(frozen=True)
class VibrationSpec:
    """Shake between pictures: each picture is taken with both devices pointing a little elsewhere.

    A small rotation of a device shifts its raster; that is exact for the traced light, to first order in the
    angle. None by default; a rig on a machine tool shakes by some tenths of a pixel.

    Parameters
    ----------
    camera_px, projector_px
        RMS shift of the raster along each of its axes, pixels.

    """

    __pydantic_config__ = STRICT

    camera_px: NotNegative = 0.0
    projector_px: NotNegative = 0.0


def per_picture(identity: tuple[int, ...], source: str, first: int, frames: int, values: int) -> Floats:
    """Standard normal values (frames, values) that depend on case, source and the pictures' numbers alone."""
    key = int(stream_key(identity, source))
    return np.stack(
        [np.random.default_rng((key, first + frame)).standard_normal(values) for frame in range(frames)]
    )


def shifted(images: Floats32, shifts_px: Floats) -> Floats32:
    """Images (F, h, w) moved by (F, 2) columns and rows, linearly interpolated; edges are repeated."""
    moved = [
        ndimage.shift(image, (shift[1], shift[0]), order=1, mode="nearest")
        for image, shift in zip(images, shifts_px, strict=True)
    ]
    return np.stack(moved).astype(np.float32)


def falloff(shape: tuple[int, int], loss: float) -> Floats32:
    """(h, w) share of light that a lens passes: 1 in the middle, 1 - ``loss`` in the corners.

    It falls with the square of the distance from the middle, the leading term of natural vignetting (cos⁴).
    """
    rows, columns = (np.linspace(-1.0, 1.0, n) for n in shape)
    h, w = shape
    reach = (rows[:, None] * h) ** 2 + (columns * w) ** 2
    return (1.0 - loss * reach / (h * h + w * w)).astype(np.float32)
