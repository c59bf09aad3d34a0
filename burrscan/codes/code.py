"""What a code family hands over: light profiles to project, and how to read the pictures of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Floats, Image, Levels, freeze
from burrscan.correspondence import Correspondence
from burrscan.devices import CameraSheet, ProjectorSheet
from burrscan.rig import View
from burrscan.scanner import Patterns


@dataclass(frozen=True)
class Code:
    """A code over the projector's columns.

    Parameters
    ----------
    light
        (F, width) light of each frame and column relative to full white, 0 .. 1, linear.
    names
        One unique name per frame.
    decode
        From the frames' images (F, h, w) DN, by the camera's data sheet, to a correspondence. It never
        needs the projector's response: the light is linear when it leaves the projector.

    """

    light: Floats
    names: tuple[str, ...]
    decode: Callable[[Image, CameraSheet], Correspondence]

    def __post_init__(self) -> None:
        freeze(self, light=self.light)


def patterns(
    light: Floats,
    names: tuple[str, ...],
    *,
    view: View,
    sheet: ProjectorSheet,
    intensity: Floats | None = None,
) -> Patterns:
    """Projector levels of column profiles, dimmed by ``intensity`` where one is given.

    Parameters
    ----------
    light
        (F, width) relative light.
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
    Rounding to 8 bits is dithered by an ordered pattern (Bayer 1973) in the dimmed case, so that the mean
    light over a few pixels is exact to a fraction of a level. O(F·height·width).

    """
    if intensity is None:
        rows = np.rint(sheet.levels(light)).astype(np.uint8)
        return Patterns(np.broadcast_to(rows[:, None, :], (len(rows), *view.shape)), names)
    frames = np.empty((len(light), *view.shape), np.uint8)
    table = _level_table(sheet)
    offsets = _bayer(view.shape)
    for frame, row in zip(frames, light, strict=True):
        wanted = (row * intensity * (len(table) - 1)).astype(np.int32)
        frame[:] = np.minimum(table[wanted] + offsets, 255.0).astype(np.uint8)
    return Patterns(frames, names)


def light_of(levels: Levels, sheet: ProjectorSheet) -> Floats:
    """The relative light that ``levels`` really give, of the same shape."""
    return np.asarray(sheet.light[levels])


def _level_table(sheet: ProjectorSheet) -> Floats:
    """Fractional level for light 0 .. 1 in fine steps; between two levels the dither is linear in light."""
    light = np.linspace(0.0, 1.0, 65_536)
    return sheet.levels(light)


def _bayer(shape: tuple[int, int]) -> Floats:
    """Ordered thresholds in (0, 1), 4×4, tiled to ``shape``."""
    tile = np.array([[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]])
    tiled = np.tile((tile + 0.5) / 16.0, (shape[0] // 4 + 1, shape[1] // 4 + 1))
    return np.asarray(tiled[: shape[0], : shape[1]])
