"""Data sheets: what the maker of a camera or a projector states, and therefore an algorithm may use."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from burrscan.arrays import Floats, freeze
from burrscan.errors import InputError

Table = tuple[tuple[float, ...], ...]
"""Rows of numbers; empty where there is nothing to say."""

_FLAT = 1e-9
"""Electrons per DN where a measured response does not rise at all."""


_FULL_Z = 4.0
"""Standard deviations of the read noise by which a full pixel may stay below the highest DN."""


@dataclass(frozen=True)
class CameraSheet:
    """A camera's data sheet, in the terms of EMVA 1288 release 4.0.

    The defaults are those of a current global-shutter sensor of 1.3 megapixels. A camera whose values are not
    linear in light has a ``response``; :mod:`burrscan.linear` takes it off before anything is computed.

    Parameters
    ----------
    bit_depth
        Bits of a raw value; images hold 0 .. 2**bit_depth - 1 DN.
    full_well_e
        Electrons at which a pixel saturates; it is mapped to the highest DN.
    read_noise_e
        Temporal dark noise, electrons RMS; it is there before the response acts.
    black_level_dn
        DN of a pixel without light.
    exposure_range_ms
        Shortest and longest exposure the shutter offers.
    response
        One row per channel, or one for all: (2**bit_depth,) light of each DN relative to the full well, not
        falling, 0 at the black level and 1 at the highest DN. Empty for a linear camera. Measured by
        :func:`burrscan.calibration.photometric.calibrate_photometry`.
    crosstalk
        (channels, bands): what each channel makes of each band of the light, ones on the diagonal. Empty for
        a camera with one channel, or none that mixes.

    Raises
    ------
    InputError
        When response or crosstalk are not such tables.

    """

    bit_depth: int = 10
    full_well_e: float = 10_000.0
    read_noise_e: float = 6.0
    black_level_dn: float = 8.0
    exposure_range_ms: tuple[float, float] = (0.05, 200.0)
    response: Table = ()
    crosstalk: Table = ()

    def __post_init__(self) -> None:
        _check_square(self.crosstalk, device="camera")
        for row in self.response:
            if len(row) != 1 << self.bit_depth or row[-1] != 1.0 or (np.diff(row) < 0.0).any():
                reach = f" from {row[0]:g} to {row[-1]:g}" if row else ""
                raise InputError(
                    f"the camera's response needs {1 << self.bit_depth} values for {self.bit_depth} bits, "
                    f"not falling, the last of them 1; it has {len(row)}{reach}"
                )

    @property
    def saturation_dn(self) -> int:
        """The highest DN."""
        return (1 << self.bit_depth) - 1

    @property
    def clipped_dn(self) -> int:
        """The lowest DN of a pixel whose well is full: what shows so much is clipped.

        A well holds no more than it holds, but is read with noise: half of all full pixels show less than the
        highest DN, and would pass for measured. Four standard deviations miss 3 of 100,000.
        """
        if not self.response:
            return self.saturation_dn - int(np.ceil(_FULL_Z * self.gain_dn_per_e * self.read_noise_e))
        lowest = 1.0 - _FULL_Z * self.read_noise_e / self.full_well_e
        dn = np.arange(self.saturation_dn + 1.0)
        return int(min(np.interp(lowest, row, dn) for row in self.response))

    @property
    def gain_dn_per_e(self) -> float:
        """DN per electron (EMVA's K); its mean over the range where a response bends it."""
        return (self.saturation_dn - self.black_level_dn) / self.full_well_e

    def channel(self, number: int) -> CameraSheet:
        """The sheet of one channel by itself."""
        row = self.response[min(number, len(self.response) - 1) :][:1]
        return replace(self, response=row, crosstalk=())

    def electrons_of(self, dn: Floats) -> Floats:
        """Electrons of DN of any shape, by the first channel's response."""
        if not self.response:
            return np.asarray((dn - self.black_level_dn) / self.gain_dn_per_e)
        return np.interp(dn, np.arange(len(self.response[0])), self.response[0]) * self.full_well_e

    def slope_e_per_dn(self, dn: Floats) -> Floats:
        """Electrons per DN at DN of any shape: the derivative of :meth:`electrons_of`, over two DN."""
        low, high = np.maximum(dn - 1.0, 0.0), np.minimum(dn + 1.0, float(self.saturation_dn))
        return np.asarray((self.electrons_of(high) - self.electrons_of(low)) / (high - low))

    def rounding_e2(self, electrons: Floats) -> Floats | float:
        """Variance, electrons², that rounding to whole DN adds to pixels of that mean: ``slope² / 12``."""
        if not self.response:
            return 1.0 / (12.0 * self.gain_dn_per_e**2)
        dn = np.arange(self.saturation_dn + 1.0)
        return np.interp(electrons, self.electrons_of(dn), self.slope_e_per_dn(dn) ** 2 / 12.0)

    def noise_dn(self, signal_dn: Floats) -> Floats:
        """Temporal standard deviation, DN, of pixels whose mean is ``signal_dn`` (EMVA 1288 eq. 11).

        A response multiplies the electrons' part by its derivative.
        """
        electrons = np.maximum(self.electrons_of(signal_dn), 0.0)
        gain2 = (
            1.0 / np.maximum(self.slope_e_per_dn(signal_dn), _FLAT) ** 2
            if self.response
            else self.gain_dn_per_e**2
        )
        noise: Floats = np.sqrt(gain2 * (electrons + self.read_noise_e**2) + 1.0 / 12.0)
        return noise


@dataclass(frozen=True)
class ProjectorSheet:
    """A projector's data sheet.

    Parameters
    ----------
    light
        (256,) light of each 8-bit level relative to full white, non-decreasing, last entry 1. The first entry
        is the black level: the reciprocal of the contrast. Or (primaries, 256), a row per primary.
    crosstalk
        (bands, primaries): the light of each band in each primary, ones on the diagonal. Empty for a
        projector of one primary, or none that mixes.

    Raises
    ------
    InputError
        When light or crosstalk are not such tables.

    """

    light: Floats
    crosstalk: Table = ()

    def __post_init__(self) -> None:
        freeze(self, light=np.asarray(self.light, dtype=float))
        _check_square(self.crosstalk, device="projector")
        if self.light.shape[-1:] != (256,) or self.light.ndim > 2:
            raise InputError(f"the projector's light needs 256 values per primary, not {self.light.shape}")

    def primary(self, number: int) -> ProjectorSheet:
        """The sheet of one primary by itself."""
        return ProjectorSheet(self.light if self.light.ndim == 1 else self.light[number])

    @classmethod
    def gamma(cls, *, gamma: float = 2.2, contrast: float = 1000.0) -> ProjectorSheet:
        """A power-law projector with a finite contrast."""
        black = 1.0 / contrast
        return cls(light=black + (1.0 - black) * np.linspace(0.0, 1.0, 256) ** gamma)

    def levels(self, light: Floats) -> Floats:
        """Levels 0 .. 255 (not yet rounded) that give ``light`` of one primary at full, clipped."""
        levels: Floats = np.interp(light, self.light, np.arange(256.0))
        return levels


def _check_square(crosstalk: Table, *, device: str) -> None:
    if any(len(row) != len(crosstalk) for row in crosstalk):
        raise InputError(f"the {device}'s crosstalk needs as many rows as columns, such as three by three")
