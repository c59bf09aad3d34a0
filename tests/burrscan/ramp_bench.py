"""Simulated ramps of an evenly lit board, for the photometric calibration.

A camera and a projector with known response curves and crosstalk, shot noise, read noise and rounding.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from burrscan.arrays import Floats, Image, Ints, freeze
from burrscan.calibration.ramps import ExposureRamp, LevelRamp


def srgb(light: Floats) -> Floats:
    """IEC 61966-2-1: a power law with a linear toe."""
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 1e-9) ** (1.0 / 2.4) - 0.055)


def s_curve(light: Floats) -> Floats:
    """A film-like curve: slow toe, slow shoulder."""
    return np.asarray(
        light + 0.12 * np.sin(2.0 * np.pi * (light - 0.5)) * np.clip(light * (1 - light) * 4, 0, 1)
    )


def linear(light: Floats) -> Floats:
    """No curve at all."""
    return light


RESPONSES = {"linear": linear, "srgb": srgb, "s": s_curve}
"""Light 0 .. 1 to output 0 .. 1."""


_OFF = 6
"""Pictures with the lamp off, exposures halved each time, as ramp folders have them."""


@dataclass(frozen=True)
class RampBench:
    """A camera and a projector in front of an even board.

    Parameters
    ----------
    camera_mix
        (channels, bands) crosstalk of the camera.
    projector_mix
        (bands, primaries) of the projector.
    responses
        Name of each channel's response, of :data:`RESPONSES`.
    gammas, contrast
        Exponent of each primary, and the projector's contrast.
    shape
        Rows and columns of the pictures.
    bit_depth, full_well_e, read_noise_e, black_dn
        The camera's electronics; the response acts on the electrons, noise and all, before rounding.
    white_ms
        Exposure at which full white fills the brightest channel's well.
    ambient
        Light of the surround, as a share of white.
    unevenness
        Loss of light from the middle to the corners.
    flicker
        Relative RMS change of the light from picture to picture.
    seed
        Of the noise.

    """

    camera_mix: Floats
    projector_mix: Floats
    responses: tuple[str, ...] = ("srgb",)
    gammas: tuple[float, ...] = (2.2,)
    contrast: float = 800.0
    shape: tuple[int, int] = (72, 96)
    bit_depth: int = 10
    full_well_e: float = 10_000.0
    read_noise_e: float = 6.0
    black_dn: float = 12.0
    white_ms: float = 20.0
    ambient: float = 0.003
    unevenness: float = 0.1
    flicker: float = 0.0
    seed: int = 0
    board: tuple[float, ...] = field(default=())

    def __post_init__(self) -> None:
        freeze(self, camera_mix=self.camera_mix, projector_mix=self.projector_mix)

    def light(self, primary: int) -> Floats:
        """(256,) true light of a primary's levels."""
        black = 1.0 / self.contrast
        return np.asarray(black + (1.0 - black) * np.linspace(0.0, 1.0, 256) ** self.gammas[primary])

    def true_curve(self, channel: int) -> Floats:
        """(2**bits,) true light of each DN relative to the highest; NaN below the black level."""
        x = np.linspace(0.0, 1.0, 200_001)
        top = (1 << self.bit_depth) - 1
        dn = self.black_dn + (top - self.black_dn) * RESPONSES[self.responses[channel]](x)
        return np.asarray(np.interp(np.arange(top + 1.0), dn, x, left=np.nan))

    def lamp_ramp(self, band: int, exposures_ms: Floats, *, power: float = 1.0) -> ExposureRamp:
        """The board under a narrow-band lamp at each exposure, then with the lamp off at some."""
        lit = np.arange(len(exposures_ms) + _OFF) < len(exposures_ms)
        times = np.append(exposures_ms, exposures_ms.max() * 2.0 ** -np.arange(float(_OFF)))
        light = np.zeros((len(times), self.camera_mix.shape[1]))
        light[lit, band] = power
        return ExposureRamp(self._pictures(light, times, band), times, lit)

    def level_ramp(self, levels: Ints, exposures_ms: tuple[float, ...]) -> LevelRamp:
        """Each primary through ``levels``, and the projector off, at each exposure."""
        primaries = self.projector_mix.shape[1]
        shown = [np.full((1, primaries), -1)]
        for primary in range(primaries):
            block = np.zeros((len(levels), primaries), int)
            block[:, primary] = levels
            shown.append(block)
        steps = np.tile(np.concatenate(shown), (len(exposures_ms), 1))
        times = np.repeat(exposures_ms, len(steps) // len(exposures_ms))
        table = np.stack(
            [np.append(self.light(k), 0.0) for k in range(primaries)]
        )  # level -1 is the last: none
        emitted = np.stack([table[k][steps[:, k]] for k in range(primaries)], axis=-1)
        return LevelRamp(self._pictures(emitted @ self.projector_mix.T, times, 99), times, steps)

    def _pictures(self, bands: Floats, exposures_ms: Floats, stream: int) -> Image:
        """Pictures (F, h, w[, channels]) under light (F, bands) at exposures (F,)."""
        rng = np.random.default_rng((self.seed, stream))
        reflected = (bands + self.ambient) * (self.board or (1.0,) * bands.shape[1])
        rate = reflected @ self.camera_mix.T * self.full_well_e / self.white_ms / self._brightest()
        rate = rate * (1.0 + self.flicker * rng.standard_normal((len(rate), 1)))
        electrons = (
            rate[:, None, None, :] * exposures_ms[:, None, None, None] * self._fall()[None, :, :, None]
        )
        noisy = rng.poisson(electrons) + rng.normal(0.0, self.read_noise_e, electrons.shape)
        x = noisy / self.full_well_e
        top = (1 << self.bit_depth) - 1
        out = np.stack([self._response(c, x[..., c]) for c in range(x.shape[-1])], axis=-1)
        images: Image = np.clip(np.rint(self.black_dn + (top - self.black_dn) * out), 0, top).astype(
            np.uint16
        )
        return images[..., 0] if images.shape[-1] == 1 else images

    def _response(self, channel: int, x: Floats) -> Floats:
        """The response, continued straight below the dark, where read noise may take the electrons."""
        response = RESPONSES[self.responses[channel]]
        slope = float(response(np.array(1e-4))) / 1e-4
        return np.where(x < 0.0, slope * x, response(np.clip(x, 0.0, 1.0)))

    def _brightest(self) -> float:
        return float((self.camera_mix @ self.projector_mix).sum(axis=1).max())

    def _fall(self) -> Floats:
        y, x = (np.linspace(-1.0, 1.0, n) for n in self.shape)
        return np.asarray(1.0 - self.unevenness * 0.5 * (y[:, None] ** 2 + x**2))
