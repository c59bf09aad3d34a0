"""Linear images of a camera that is not linear: the one place where a response curve is taken off.

Noise arises before the curve, in electrons, so undoing the curve gives back the light with its noise, exactly
but for the rounding to whole DN. What comes out are the pictures of a linear camera, and its data sheet: what
decodes them need not know that there was a curve. A linear camera passes through untouched.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from burrscan.arrays import Floats, Image
from burrscan.devices import CameraSheet
from burrscan.scanner import PassThrough, Patterns, Scanner

_BITS = 16
"""Of the linear camera's pictures: sixteen linear steps, on average, to a DN of a 12-bit camera."""
_TOP = (1 << _BITS) - 1
"""The highest linear DN; only saturated pixels have it."""


class LinearScanner(PassThrough):
    """A scanner whose pictures are linear in light, in front of one whose pictures are not."""

    @property
    def camera(self) -> CameraSheet:
        """The data sheet of the linear camera."""
        return linear_camera(self._scanner.camera)

    def capture(self, patterns: Patterns, exposure_ms: float) -> Image:
        """Capture, and take the response off: (F, h, w) DN of the linear camera."""
        return linear_images(self._scanner.capture(patterns, exposure_ms), self._scanner.camera)


def linear(scanner: Scanner) -> Scanner:
    """The scanner itself where its camera is linear, else a linear one in front of it."""
    return LinearScanner(scanner) if scanner.camera.response else scanner


def linear_images(images: Image, camera: CameraSheet) -> Image:
    """Images with the camera's response taken off, 16-bit DN of :func:`linear_camera`. O(n).

    Parameters
    ----------
    images
        (..., h, w) raw DN, or (..., h, w, channels) where the response has a row per channel.
    camera
        The raw camera.

    """
    if not camera.response:
        return images
    tables = [_table(row, _black_dn(camera), camera.clipped_dn) for row in camera.response]
    if len(tables) == 1:
        return np.asarray(tables[0].take(images, mode="clip"))
    channels = [table.take(images[..., c], mode="clip") for c, table in enumerate(tables)]
    return np.stack(channels, axis=-1)


@lru_cache(maxsize=8)
def linear_camera(camera: CameraSheet) -> CameraSheet:
    """The sheet of the linear camera that :func:`linear_images` gives the pictures of.

    A step of the raw camera is worth ``slope`` electrons, so that rounding adds ``slope² / 12`` to the
    variance, more where the curve is flat. The straight line ``a + b · signal`` that is nearest to it
    relative to the whole variance goes into the read noise (a), and into fewer, larger electrons (b): a
    camera of 1 + b times fewer electrons has just that much more noise.
    """
    if not camera.response:
        return camera
    dn = np.arange(np.ceil(camera.black_level_dn) + 1.0, camera.saturation_dn)
    electrons = np.maximum(camera.electrons_of(dn), 0.0)
    rounding = np.asarray(camera.rounding_e2(electrons))
    floor = camera.read_noise_e**2
    weight = 1.0 / (electrons + floor + rounding)
    (a, b), _ = nnls(np.stack([weight, electrons * weight], axis=-1), rounding * weight)
    return replace(
        camera,
        bit_depth=_BITS,
        full_well_e=camera.full_well_e / (1.0 + b),
        read_noise_e=float(np.sqrt(floor + a)) / (1.0 + b),
        black_level_dn=_black_dn(camera),
        response=(),
    )


def _black_dn(camera: CameraSheet) -> float:
    """The linear camera's black level: the light of DN 0, which noise may reach, is at or above its 0."""
    below = max(0.0, *(-row[0] for row in camera.response))
    return float(np.ceil(_TOP * below / (1.0 + below)))


@lru_cache(maxsize=8)
def _table(light: tuple[float, ...], black: float, clipped_dn: int) -> NDArray[np.uint16]:
    """Linear DN of each raw DN; what a full well may show is saturated: a raw DN is many linear ones."""
    values: Floats = np.rint(black + (_TOP - black) * np.asarray(light))
    values[clipped_dn:] = _TOP
    return np.maximum(values, 0.0).astype(np.uint16)
