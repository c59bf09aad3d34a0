"""A small scanner in colour over analytic geometry: the grey one's light, primaries mixed to channels."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from burrscan.arrays import Floats, Image
from burrscan.devices import CameraSheet, ProjectorSheet
from burrscan.rig import Rig
from burrscan.scanner import Patterns
from tests.burrscan.instrument import Instrument, small_rig

CAMERA_MIX = ((1.0, 0.12, 0.03), (0.10, 1.0, 0.08), (0.02, 0.15, 1.0))
PROJECTOR_MIX = ((1.0, 0.08, 0.01), (0.06, 1.0, 0.07), (0.01, 0.05, 1.0))
COPPER = (0.9, 0.62, 0.55)


def planted() -> Floats:
    """The mixing matrix of the default instrument."""
    return np.asarray(np.array(CAMERA_MIX) @ np.diag(COPPER) @ np.array(PROJECTOR_MIX))


@dataclass
class ColourInstrument:
    """A scanner in colour; ``mixing`` is (channels, primaries)."""

    grey: Instrument = field(default_factory=lambda: Instrument(small_rig(width=120), decades=1.5))
    mixing: Floats = field(default_factory=planted)
    camera: CameraSheet = CameraSheet(crosstalk=CAMERA_MIX)
    projector: ProjectorSheet = field(
        default_factory=lambda: ProjectorSheet(ProjectorSheet.gamma().light, PROJECTOR_MIX)
    )
    seed: int = 3
    frames: int = 0

    def __post_init__(self) -> None:
        self._rng = np.random.default_rng(self.seed)

    @property
    def rig(self) -> Rig:
        return self.grey.rig

    def capture(self, patterns: Patterns, exposure_ms: float) -> Image:
        self.frames += len(patterns)
        return np.stack([self._picture(frame, exposure_ms) for frame in patterns.frames])

    def _picture(self, frame: object, exposure_ms: float) -> Image:
        levels = np.asarray(frame)
        lit = [self.grey._matrix @ self.projector.light[levels[..., k]].ravel() for k in range(3)]
        mean = exposure_ms * (np.stack(lit, axis=-1) @ self.mixing.T + 0.02)
        electrons = self._rng.poisson(mean) + self._rng.normal(0.0, self.camera.read_noise_e, mean.shape)
        dn = np.rint(self.camera.black_level_dn + self.camera.gain_dn_per_e * electrons)
        image: Image = np.clip(dn, 0, self.camera.saturation_dn).astype(np.uint16)
        return image.reshape(*self.rig.camera.shape, 3)
