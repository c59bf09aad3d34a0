"""How many electrons a camera's light is: its noise against its signal, from ramps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import nnls

from burrscan.arrays import Floats
from burrscan.calibration.camera_response import ResponseCurve
from burrscan.calibration.ramps import ExposureRamp, tiles_of
from burrscan.errors import InputError

_STEPS = 4
"""Reweightings by the modelled variance, which starts at the observed one."""
_LEAST_DN2 = 0.25
"""Below this variance the rounding is no noise of its own any more, and says nothing of the electrons."""


def photon_transfer(ramps: Sequence[ExposureRamp], curves: Sequence[ResponseCurve]) -> tuple[float, float]:
    """Full well and read noise, electrons, from the noise within tiles (EMVA 1288 release 4.0, section 6).

    In units of the full well W the variance of light x is ``x / W + (read noise / W)² + (g x)²``: shot noise,
    read noise, and the pixels' uneven gain g, which neighbours' differences hold as well. All channels and
    pictures together, weighted by the variance that the fit itself gives. O(pixels · pictures).

    Raises
    ------
    InputError
        When the pictures show no noise that grows with their light.

    """
    parts = [_noise(ramp, curve, channel) for ramp in ramps for channel, curve in enumerate(curves)]
    light, variance = (np.concatenate(column) for column in zip(*parts, strict=True))
    terms = np.stack([np.maximum(light, 0.0), np.ones_like(light), light**2], axis=-1)
    modelled = np.maximum(variance, 1e-3 * variance.mean())
    found = np.zeros(3)
    for _ in range(_STEPS):
        weight = 1.0 / modelled
        found = nnls(terms * weight[:, None], variance * weight)[0]
        modelled = np.maximum(terms @ found, 1e-3 * variance.mean())
    if not found[0] > 0.0:
        raise InputError("the ramps show no shot noise: are the pictures averaged, compressed or denoised?")
    well = 1.0 / float(found[0])
    return well, well * float(np.sqrt(found[1]))


def _noise(ramp: ExposureRamp, curve: ResponseCurve, channel: int) -> tuple[Floats, Floats]:
    """Light and its variance of a channel's usable tiles, the rounding's part taken off."""
    tiles = tiles_of(ramp.images, saturation_dn=len(curve.light) - 1)
    dn, variance = tiles.dn[..., channel], tiles.variance_dn2[..., channel]
    seen = tiles.usable[..., channel] & (variance > _LEAST_DN2)
    sigma = np.sqrt(variance[seen])
    slope = (curve.light_of(dn[seen] + sigma) - curve.light_of(dn[seen] - sigma)) / (2.0 * sigma)
    return curve.light_of(dn[seen]), slope**2 * (variance[seen] - 1.0 / 12.0)
