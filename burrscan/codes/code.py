"""What a code family hands over: light profiles to project, and how to read the pictures of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Floats, Floats32, Image, Levels, freeze
from burrscan.correspondence import Correspondence
from burrscan.devices import CameraSheet, ProjectorSheet
from burrscan.linear import linear_camera, linear_images
from burrscan.rig import View
from burrscan.scanner import Patterns

_TABLE = 65_536
"""Lights between 0 and 1 whose levels are looked up: 1/65 535 is far below a projector's step of 1/255."""


@dataclass(frozen=True)
class Code:
    """A code over the projector's columns.

    Parameters
    ----------
    light
        (F, width) light of each frame and column relative to full white, 0 .. 1, linear.
    names
        One unique name per frame.
    decode_linear
        From the frames' images (F, h, w) DN, by a linear camera's data sheet, to a correspondence. It never
        needs the projector's response: the light is linear when it leaves the projector.

    """

    light: Floats
    names: tuple[str, ...]
    decode_linear: Callable[[Image, CameraSheet], Correspondence]

    def __post_init__(self) -> None:
        freeze(self, light=self.light)

    def decode(self, images: Image, camera: CameraSheet) -> Correspondence:
        """Images (F, h, w) DN of any camera to a correspondence; a response curve is taken off first."""
        return self.decode_linear(linear_images(images, camera), linear_camera(camera))


def patterns(
    light: Iterable[Floats | Floats32],
    names: tuple[str, ...],
    *,
    view: View,
    sheet: ProjectorSheet,
    intensity: Floats | None = None,
) -> Patterns:
    """Projector levels of frames of light, dimmed by ``intensity`` where one is given.

    Parameters
    ----------
    light
        Per frame, relative light of each column (width,) or of each pixel (height, width).
    names
        One per frame.
    view
        The projector's size.
    sheet
        The projector's response.
    intensity
        (height, width) factor 0 .. 1 on the light, or None for full light.

    Notes
    -----
    Plain columns are rounded to the nearest level and stay a broadcast view. Anything else is dithered by an
    ordered pattern (Bayer 1973), so that the mean light over a few pixels is exact to a fraction of a level.
    O(F·height·width).

    """
    frames = list(light) if intensity is None else light
    if isinstance(frames, list) and all(frame.ndim == 1 for frame in frames):
        rows = np.rint(sheet.levels(np.stack(frames))).astype(np.uint8)
        return Patterns(np.broadcast_to(rows[:, None, :], (len(rows), *view.shape)), names)
    factor = np.float32(_TABLE - 1) * (1.0 if intensity is None else intensity.astype(np.float32))
    table = sheet.levels(np.linspace(0.0, 1.0, _TABLE)).astype(np.float32)
    offsets = bayer(view.shape)
    levels = np.empty((len(names), *view.shape), np.uint8)
    for frame, one in zip(levels, frames, strict=True):
        wanted = np.clip(one * factor, 0.0, _TABLE - 1).astype(np.int32)
        frame[:] = np.minimum(table[wanted] + offsets, 255.0).astype(np.uint8)
    return Patterns(levels, names)


def light_of(levels: Levels, sheet: ProjectorSheet) -> Floats:
    """The relative light that ``levels`` really give, of the same shape."""
    return np.asarray(sheet.light[levels])


def bayer(shape: tuple[int, int]) -> Floats32:
    """Ordered thresholds in (0, 1), 4×4, tiled to ``shape``."""
    tile = np.array([[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]])
    tiled = np.tile((tile + 0.5) / 16.0, (shape[0] // 4 + 1, shape[1] // 4 + 1))
    return np.asarray(tiled[: shape[0], : shape[1]], np.float32)
