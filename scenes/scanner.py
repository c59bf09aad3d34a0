"""The simulated scanner: the instrument around the light."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats, Floats32, Image, Levels
from burrscan.devices import CameraSheet, ProjectorSheet
from burrscan.errors import InputError
from burrscan.rig import Rig
from burrscan.scanner import Patterns
from burrscan.sideways import across_columns, on_its_side, runs_along_columns
from scenes.electronics.drift import falloff, per_picture, shifted
from scenes.electronics.sensor import expose
from scenes.light import Light
from scenes.scene import SceneSpec


class SimulatedScanner:
    """A :class:`burrscan.Scanner` in front of a simulated scene.

    Parameters
    ----------
    light
        The scene's light.
    scene
        The electronics and the surround.
    rig
        The calibration that algorithms are told.
    identity
        Fixes the noise. Pictures are counted: the n-th picture of two equal scanners has the same noise.
    sheets
        The data sheets that algorithms are told; the true ones by default.

    """

    _frame_axes = 3

    def __init__(
        self,
        light: Light,
        *,
        scene: SceneSpec,
        rig: Rig,
        identity: tuple[int, ...],
        sheets: tuple[CameraSheet, ProjectorSheet] | None = None,
    ) -> None:
        self._camera, self._projector = sheets or (scene.camera.sheet, scene.projector.sheet)
        self._light = light
        self._scene = scene
        self._rig = rig
        self._identity = identity
        self._taken = 0

    @property
    def rig(self) -> Rig:
        """The calibration as the algorithm is told it."""
        return self._rig

    @property
    def camera(self) -> CameraSheet:
        """The camera's data sheet as the algorithm is told it."""
        return self._camera

    @property
    def projector(self) -> ProjectorSheet:
        """The projector's data sheet as the algorithm is told it."""
        return self._projector

    def capture(self, patterns: Patterns, exposure_ms: float) -> Image:
        """Show each pattern, expose for ``exposure_ms`` and return the images, (F, h, w) DN.

        Raises
        ------
        InputError
            When the exposure is outside what the camera offers, or a pattern does not fit the projector.

        """
        self._check(patterns, exposure_ms)
        first = self._taken
        self._taken += len(patterns)
        emitted = emission(self._raster(patterns.frames), self._scene.projector.sheet.light)
        received = self._received(self._light, emitted, first)
        return expose(
            received,
            camera=self._scene.camera,
            exposure_ms=exposure_ms,
            identity=self._identity,
            first_frame=first,
        )

    def _check(self, patterns: Patterns, exposure_ms: float) -> None:
        shortest, longest = self.camera.exposure_range_ms
        if not shortest <= exposure_ms <= longest:
            raise InputError(
                f"exposure of {exposure_ms:g} ms is outside the camera's {shortest:g} to {longest:g} ms"
            )
        if patterns.frames.ndim != self._frame_axes:
            kinds = {3: "grey", 4: "in colour"}
            raise InputError(
                f"the patterns are {kinds[patterns.frames.ndim]} and the scanner is "
                f"{kinds[self._frame_axes]}: strategy 'colour' is for scanners in colour, the others are for "
                "grey ones"
            )
        if patterns.frames.shape[1:3] != self._rig.projector.shape:
            raise InputError(
                f"patterns of {patterns.frames.shape[1:3]} do not fit a projector of "
                f"{self._rig.projector.shape}"
            )

    def _raster(self, frames: Levels) -> Levels:
        """Frames in the raster that light was traced for, whose columns lie across the baseline."""
        return on_its_side(frames) if runs_along_columns(self._scene.rig.rig()) else frames

    def _received(self, light: Light, emitted: Floats32, first: int) -> Floats32:
        """Light on the sensor, (F, h, w), when the projector's lamp emits (F, H, W)."""
        received = light.relight(self._projected(emitted, first))
        received += light.ambient * self._scene.light.ambient
        shake = self._scene.vibration.camera_px
        if shake:
            received = shifted(received, shake * self._drawn("camera vibration", first, len(emitted), 2))
        if self._scene.camera.vignetting:
            received *= falloff(self._scene.rig.rig().camera, self._scene.camera.vignetting)
        return received

    def _projected(self, light: Floats32, first: int) -> Floats32:
        """Light that leaves the projector."""
        spec = self._scene.projector
        if spec.flicker:
            gain = 1.0 + spec.flicker * self._drawn("projector flicker", first, len(light), 1)
            light = light * gain[:, :, None].astype(np.float32)
        if spec.vignetting:
            light = light * falloff(across_columns(self._scene.rig.rig()).projector, spec.vignetting)
        shake = self._scene.vibration.projector_px
        return (
            shifted(light, shake * self._drawn("projector vibration", first, len(light), 2))
            if shake
            else light
        )

    def _drawn(self, source: str, first: int, frames: int, values: int) -> Floats:
        return per_picture(self._identity, source, first, frames, values)


def emission(frames: Levels, light: Floats) -> Floats32:
    """Light of levels (F, H, W); frames that do not vary along the rows stay broadcast."""
    table = light.astype(np.float32)
    if frames.strides[1] == 0:
        return np.broadcast_to(table[frames[:, :1]], frames.shape)
    return np.asarray(table[frames])
