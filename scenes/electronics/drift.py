"""What changes from picture to picture: the projector's brightness and where both devices point."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field
from scipy import ndimage

from burrscan.arrays import Floats, Floats32
from burrscan.documents import STRICT
from burrscan.rig import View
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


def falloff(view: View, loss: float) -> Floats32:
    """(h, w) share of light that a lens passes: cos⁴ of the angle to its axis (natural vignetting).

    The axis is the principal point. ``loss`` is what half a diagonal away from it is lost, whatever the field
    of view: ``1 / (1 + k r²)²`` is cos⁴ of the angle whose tangent is ``√k r`` (Reiss 1945, the cos⁴ law).
    A plain thin lens of this focal length would lose ``1 - cos⁴``; a mechanically vignetted one loses more.
    """
    x, y = np.arange(view.width) - view.cx, np.arange(view.height) - view.cy
    r2 = (x**2 + y[:, None] ** 2) / (0.25 * (view.width**2 + view.height**2))
    k = 1.0 / np.sqrt(1.0 - loss) - 1.0
    share: Floats32 = ((1.0 + k * r2) ** -2).astype(np.float32)
    return share
