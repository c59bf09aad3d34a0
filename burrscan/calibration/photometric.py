"""Photometric calibration: response curves and crosstalk of camera and projector, from ramps of a board.

What can be known
-----------------
Light of the projector's primaries p reaches the linear camera as ``y = C · diag(s) · P · p``: the projector's
primaries spread over three bands (P), the board returns a share s of each, the camera's channels mix the
bands (C). A board under the projector alone shows the product ``C diag(s) P``, nine numbers; no number of
projected ramps tells C from P, and any invertible matrix may move from one to the other. What separates them
is light whose band is known:

1. **Lamp ramps**: the evenly lit board under a narrow-band lamp (LED) of each band in turn, the projector
   covered, at many exposures; some pictures with the lamp off. The time axis gives the response curves of the
   camera; the channels' ratios under lamp b give column b of C. The lamp's power cancels in the ratio.
2. **Level ramps**: the board under the projector, one primary at a time through its levels, some pictures
   with the projector covered. They give each primary's curve and, with C from before, P.

A camera's curve is scaled to the light of its highest DN, which is reached by continuing the curve from where
clipping begins: that unit is the least known number of all, and a channel's unit is in its row of C.

Gauge: both matrices have ones on their diagonals. For C that divides each column by the camera's own channel.
For P it divides each column by the primary's own band, the light of a band being counted in what the camera's
own channel makes of it off this board. The quantum efficiency of a channel, the lamp's power, the board's
reflectance in a band (s) and the brightness of a primary are factors of rows and columns that this takes out;
``full`` keeps the primaries' brightness. Another board or unit g of the bands turns P into
``diag(g) P diag(1/g)``; on a spectrally neutral board, and with units of equal energy, P is the projector's.

With one channel there is nothing to separate: both matrices are 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Floats, freeze
from burrscan.calibration.camera_response import ResponseCurve, camera_responses
from burrscan.calibration.photon_transfer import photon_transfer
from burrscan.calibration.projector_response import ProjectorResponse, projector_response
from burrscan.calibration.ramps import ExposureRamp, LevelRamp, tiles_of
from burrscan.devices import CameraSheet, ProjectorSheet
from burrscan.errors import InputError

_DRAWS = 2000
"""Of the propagation of distributions: a standard deviation of so many is known to 1.6 %."""


@dataclass(frozen=True)
class Photometry:
    """A photometric calibration; uncertainties are standard deviations.

    Parameters
    ----------
    camera
        A response curve per channel.
    projector
        Response curves per primary, and what the camera sees of them.
    camera_mix, camera_mix_sigma
        (channels, bands) C, ones on the diagonal.
    projector_mix, projector_mix_sigma
        (bands, primaries) P, ones on the diagonal.
    full
        (primaries,) light of each primary at 255 in its own band, per ms, relative to the camera's
        saturation.
    full_well_e, read_noise_e
        Of the camera, by the noise of the ramps.

    """

    camera: tuple[ResponseCurve, ...]
    projector: ProjectorResponse
    camera_mix: Floats
    camera_mix_sigma: Floats
    projector_mix: Floats
    projector_mix_sigma: Floats
    full: Floats
    full_well_e: float
    read_noise_e: float

    def __post_init__(self) -> None:
        freeze(self, camera_mix=self.camera_mix, camera_mix_sigma=self.camera_mix_sigma, full=self.full)
        freeze(self, projector_mix=self.projector_mix, projector_mix_sigma=self.projector_mix_sigma)

    def camera_sheet(self, *, exposure_range_ms: tuple[float, float]) -> CameraSheet:
        """The camera's data sheet as measured."""
        response = [np.maximum.accumulate(curve.light) for curve in self.camera]
        return CameraSheet(
            bit_depth=len(response[0]).bit_length() - 1,
            full_well_e=self.full_well_e,
            read_noise_e=self.read_noise_e,
            black_level_dn=max(float(np.mean([curve.black_dn for curve in self.camera])), 0.0),
            exposure_range_ms=exposure_range_ms,
            response=tuple(tuple(row.tolist()) for row in response),
            crosstalk=_table(self.camera_mix),
        )

    def projector_sheet(self) -> ProjectorSheet:
        """The projector's data sheet as measured."""
        light = np.stack([sheet.light for sheet in self.projector.sheets])
        return ProjectorSheet(light[0] if len(light) == 1 else light, _table(self.projector_mix))


def calibrate_photometry(lamps: Sequence[ExposureRamp], levels: LevelRamp, *, bit_depth: int) -> Photometry:
    """Calibrate both devices.

    Parameters
    ----------
    lamps
        One exposure ramp per band, in the order of the camera's channels; one white lamp for a grey camera.
    levels
        The projector's ramps.
    bit_depth
        Of the camera.

    Raises
    ------
    InputError
        When lamps, channels and primaries differ in number, or a ramp does not cover the range.

    """
    channels = 1 if levels.images.ndim == 3 else levels.images.shape[-1]
    if not len(lamps) == channels == levels.levels.shape[1]:
        raise InputError(
            f"{len(lamps)} lamp(s), {channels} camera channel(s) and {levels.levels.shape[1]} primaries: "
            "crosstalk needs as many of each (one for a grey camera, three for a colour camera)"
        )
    curves = camera_responses(lamps, bit_depth=bit_depth)
    full_well_e, read_noise_e = photon_transfer(lamps, curves)
    projector = projector_response(levels, curves)
    mix, mix_sigma = camera_mix(lamps, curves)
    bands = np.linalg.solve(mix, projector.seen)
    bands_mix = bands / np.diag(bands)
    bands_sigma = _mix_sigma(mix, mix_sigma, projector)
    return Photometry(
        camera=curves,
        projector=projector,
        camera_mix=mix,
        camera_mix_sigma=_with_units(mix, mix_sigma, curves),
        projector_mix=bands_mix,
        projector_mix_sigma=_with_units(bands_mix, bands_sigma, curves),
        full=np.diag(bands).copy(),
        full_well_e=full_well_e,
        read_noise_e=read_noise_e,
    )


def _table(mix: Floats) -> tuple[tuple[float, ...], ...]:
    """Rows of a crosstalk matrix; none where there is one channel, which mixes with nothing."""
    return () if len(mix) == 1 else tuple(tuple(row) for row in mix.tolist())


def camera_mix(lamps: Sequence[ExposureRamp], curves: Sequence[ResponseCurve]) -> tuple[Floats, Floats]:
    """C, a column per lamp: the channels' light over the own one's; its deviation but for the units."""
    columns = [_column(lamp, curves, band) for band, lamp in enumerate(lamps)]
    return np.stack([c for c, _ in columns], axis=-1), np.stack([s for _, s in columns], axis=-1)


def _column(lamp: ExposureRamp, curves: Sequence[ResponseCurve], band: int) -> tuple[Floats, Floats]:
    rates = [_lamp_rate(lamp, curve, channel) for channel, curve in enumerate(curves)]
    own, own_sigma = rates[band]
    column = np.array([rate / own for rate, _ in rates])
    sigma = np.array([np.hypot(s / own, rate / own * own_sigma / own) for rate, s in rates])
    sigma[band] = 0.0
    return column, sigma


def _lamp_rate(lamp: ExposureRamp, curve: ResponseCurve, channel: int) -> tuple[float, float]:
    """Light per ms of the lamp in one channel, mean of the board, less the surround; its deviation."""
    tiles = tiles_of(lamp.images, saturation_dn=len(curve.light) - 1)
    dn, usable = tiles.dn[..., channel], tiles.usable[..., channel]
    sigma = curve.slope_of(dn) * tiles.sigma_dn[..., channel]
    weight = np.where(usable, 1.0 / np.maximum(sigma, 1e-12), 0.0) ** 2
    total, variance = 0.0, 0.0
    for lit, sign in ((True, 1.0), (False, -1.0)):
        chosen = lamp.lit == lit
        seen = usable[chosen].any(axis=0)
        t = lamp.exposures_ms[chosen][:, None]
        if not seen.any():  # darker than can be told from nothing
            lowest = float(curve.light_of(np.array(curve.measured_dn[0])))
            variance += (lowest / float(t.max(initial=1e-3))) ** 2 if len(t) else 0.0
            continue
        w, values = weight[chosen][:, seen], dn[chosen][:, seen]
        information = (w * t * t).sum(axis=0)
        rate = (w * t * curve.light_of(values)).sum(axis=0) / information
        systematic = (w * t * curve.sigma_of(values)).sum(axis=0) / information
        total += sign * float(rate.mean())
        variance += float(systematic.mean()) ** 2 + float(np.mean(1.0 / information)) / len(rate)
    return total, float(np.sqrt(variance))


def _with_units(mix: Floats, sigma: Floats, curves: Sequence[ResponseCurve]) -> Floats:
    """Add what the channels' units leave open: the light of the highest DN, to which each curve is scaled."""
    unit = np.array([curve.shape_sigma[-1] for curve in curves])
    apart = np.hypot(unit[:, None], unit[None, :]) * (1.0 - np.eye(len(unit)))
    return np.asarray(np.hypot(sigma, mix * apart))


def _mix_sigma(mix: Floats, mix_sigma: Floats, projector: ProjectorResponse) -> Floats:
    """Standard deviation of P by drawing C and what the camera saw within theirs (GUM supplement 1)."""
    rng = np.random.default_rng(0)
    size = (_DRAWS, *mix.shape)
    drawn = np.linalg.solve(
        mix + mix_sigma * rng.standard_normal(size),
        projector.seen + projector.seen_sigma * rng.standard_normal(size),
    )
    own = np.einsum("nkk->nk", drawn)
    return np.asarray((drawn / own[:, None, :]).std(axis=0))
