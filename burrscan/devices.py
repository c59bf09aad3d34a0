"""Data sheets: what the maker of a camera or a projector states, and therefore an algorithm may use."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Floats, freeze


@dataclass(frozen=True)
class CameraSheet:
    """A camera's data sheet, in the terms of EMVA 1288 release 4.0.

    Parameters
    ----------
    bit_depth
        Bits of a raw value; images hold 0 .. 2**bit_depth - 1 DN.
    full_well_e
        Electrons at which a pixel saturates; it is mapped to the highest DN.
    read_noise_e
        Temporal dark noise, electrons RMS.
    black_level_dn
        DN of a pixel without light.
    exposure_range_ms
        Shortest and longest exposure the shutter offers.

    """

    bit_depth: int = 10
    full_well_e: float = 10_000.0
    read_noise_e: float = 6.0
    black_level_dn: float = 8.0
    exposure_range_ms: tuple[float, float] = (0.05, 200.0)

    @property
    def saturation_dn(self) -> int:
        """The highest DN; a pixel that shows it is clipped."""
        return (1 << self.bit_depth) - 1

    @property
    def gain_dn_per_e(self) -> float:
        """DN per electron (EMVA's K)."""
        return (self.saturation_dn - self.black_level_dn) / self.full_well_e

    def noise_dn(self, signal_dn: Floats) -> Floats:
        """Temporal standard deviation, DN, of pixels whose mean is ``signal_dn`` (EMVA 1288 eq. 11)."""
        electrons = np.maximum(signal_dn - self.black_level_dn, 0.0) / self.gain_dn_per_e
        gain2 = self.gain_dn_per_e**2
        noise: Floats = np.sqrt(gain2 * (electrons + self.read_noise_e**2) + 1.0 / 12.0)
        return noise


@dataclass(frozen=True)
class ProjectorSheet:
    """A projector's data sheet.

    Parameters
    ----------
    light
        (256,) light of each 8-bit level relative to full white, non-decreasing, last entry 1. The first entry
        is the black level: the reciprocal of the contrast.

    """

    light: Floats

    def __post_init__(self) -> None:
        freeze(self, light=np.asarray(self.light, dtype=float))

    @classmethod
    def gamma(cls, *, gamma: float = 2.2, contrast: float = 1000.0) -> ProjectorSheet:
        """A power-law projector with a finite contrast."""
        black = 1.0 / contrast
        return cls(light=black + (1.0 - black) * np.linspace(0.0, 1.0, 256) ** gamma)

    def levels(self, light: Floats) -> Floats:
        """Levels 0 .. 255 (not yet rounded) that give ``light`` relative to full white, clipped."""
        levels: Floats = np.interp(light, self.light, np.arange(256.0))
        return levels
