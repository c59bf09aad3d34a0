"""A scene in three colours: a projector of three primaries, a metal of its colour, a camera of three chips.

Light is traced once per band, with the same samples and the band's own optical constants, so that the bands
differ by the metal alone. With E_k the light of primary k, T_b the light transport of band b, P and C the
crosstalk of projector and camera (:mod:`scenes.electronics.spec`):

    channel_c = Σ_b C[c, b] · T_b (Σ_k P[b, k] E_k)

Each channel has its own noise; flicker and vibration are the whole instrument's. A sensor with a mosaic,
whose pixels see one colour each, is not modelled: every pixel has all three channels, as in a
three-chip camera.
"""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats, Floats32, Image
from burrscan.devices import CameraSheet, ProjectorSheet
from burrscan.rig import Rig
from burrscan.scanner import Patterns
from scenes.electronics.sensor import expose
from scenes.finish import Channels
from scenes.light import Light
from scenes.scanner import SimulatedScanner, emission
from scenes.scene import SceneSpec

BANDS: tuple[Channels, ...] = ("red", "green", "blue")
MONO: tuple[Channels, ...] = ("mono",)


class ColourScanner(SimulatedScanner):
    """A simulated scanner in colour: patterns (F, H, W, 3) in, images (F, h, w, 3) out, red first.

    Parameters
    ----------
    bands
        The light of each band.
    scene, rig, identity, sheets
        As for :class:`scenes.scanner.SimulatedScanner`.

    """

    _frame_axes = 4

    def __init__(
        self,
        bands: tuple[Light, ...],
        *,
        scene: SceneSpec,
        rig: Rig,
        identity: tuple[int, ...],
        sheets: tuple[CameraSheet, ProjectorSheet] | None = None,
    ) -> None:
        super().__init__(bands[0], scene=scene, rig=rig, identity=identity, sheets=sheets)
        self._bands = bands

    def capture(self, patterns: Patterns, exposure_ms: float) -> Image:
        """Show each pattern, expose for ``exposure_ms`` and return the images, (F, h, w, 3) DN.

        Raises
        ------
        InputError
            When the exposure is outside what the camera offers, or a pattern does not fit the projector.

        """
        self._check(patterns, exposure_ms)
        first = self._taken
        self._taken += len(patterns)
        light = self._projected_bands(patterns)
        received = [self._received(T, one, first) for T, one in zip(self._bands, light, strict=True)]
        mix = _matrix(self._scene.camera.crosstalk)
        images = [
            expose(
                _mixed(received, row),
                camera=self._scene.camera,
                exposure_ms=exposure_ms,
                identity=(*self._identity, channel + 1),  # a trailing 0 would be the grey scanner's
                first_frame=first,
            )
            for channel, row in enumerate(mix)
        ]
        return np.stack(images, axis=-1)

    def _projected_bands(self, patterns: Patterns) -> list[Floats32]:
        """Light of each band (F, H, W) as it leaves the projector."""
        sheet = self._scene.projector.sheet
        frames = self._raster(patterns.frames)
        primaries = [emission(frames[..., k], sheet.primary(k).light) for k in range(len(BANDS))]
        if all(one.strides[1] == 0 for one in primaries):  # columns stay broadcast
            shape = primaries[0].shape
            rows = [one[:, :1] for one in primaries]
            return [np.broadcast_to(_mixed(rows, row), shape) for row in _matrix(sheet.crosstalk)]
        return [_mixed(primaries, row) for row in _matrix(sheet.crosstalk)]


def _matrix(crosstalk: tuple[tuple[float, ...], ...]) -> Floats:
    return np.array(crosstalk) if crosstalk else np.eye(len(BANDS))


def _mixed(parts: list[Floats32], weights: Floats) -> Floats32:
    """Sum of the parts with a row of a crosstalk matrix; zeros cost nothing."""
    used = [np.float32(w) * part for w, part in zip(weights, parts, strict=True) if w]
    return np.asarray(sum(used[1:], start=used[0]))
