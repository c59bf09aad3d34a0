"""N-step phase shifting of sine stripes.

Srinivasan, Liu, Halioua 1984; noise: sigma_phase = sqrt(2 / N) sigma_I / amplitude (Surrel 1997).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit, prange

from burrscan.arrays import Bools, Floats, Floats32, Image
from burrscan.devices import CameraSheet


@dataclass(frozen=True)
class Phase:
    """One stripe period's decoded phase, as a position within the period.

    Parameters
    ----------
    offset_px
        (h, w) position within the period, 0 .. period, column 0 at 0.
    sigma_px
        (h, w) its standard deviation by the camera's noise, px; infinite without modulation.
    amplitude_dn, mean_dn
        (h, w) of the sine.
    clipped
        (h, w) True where any step reached saturation.
    period_px
        Columns per period.

    """

    offset_px: Floats32
    sigma_px: Floats32
    amplitude_dn: Floats32
    mean_dn: Floats32
    clipped: Bools
    period_px: float


def encode_phase(*, width: int, period_px: float, steps: int) -> tuple[Floats, tuple[str, ...]]:
    """Light (steps, width) ½ + ½ cos(2π (u / period - n / steps)), and names. O(steps·width)."""
    turns = np.arange(width) / period_px - np.arange(steps)[:, None] / steps
    names = tuple(f"sine-u-{period_px:.4g}px-{n:02d}" for n in range(steps))
    return 0.5 + 0.5 * np.cos(2.0 * np.pi * turns), names


def decode_phase(images: Image, *, camera: CameraSheet, period_px: float) -> Phase:
    """Phase, modulation and stated sigma from N >= 3 equally spaced steps.

    Parameters
    ----------
    images
        (N, h, w) DN, in the order of :func:`encode_phase`.
    camera
        Gives each value's variance, which is propagated through the estimate step by step.
    period_px
        Columns per period.

    Notes
    -----
    O(N) per pixel, one pass over the images.

    """
    steps = len(images)
    turn = 2.0 * np.pi * np.arange(steps) / steps
    floor = (camera.gain_dn_per_e * camera.read_noise_e) ** 2 + 1.0 / 12.0
    offset, sigma, amplitude, mean, clipped = _phase(
        images,
        np.cos(turn),
        np.sin(turn),
        camera.black_level_dn,
        camera.gain_dn_per_e,
        floor,
        camera.saturation_dn,
        period_px / (2.0 * np.pi),
    )
    return Phase(offset, sigma, amplitude, mean, clipped, period_px)


@njit(cache=True, parallel=True, nogil=True)
def _phase(
    images: Image,
    cosine: Floats,
    sine: Floats,
    black: float,
    gain: float,
    floor: float,
    saturation: int,
    px_per_rad: float,
) -> tuple[Floats32, Floats32, Floats32, Floats32, Bools]:
    steps, height, width = images.shape
    offset = np.empty((height, width), np.float32)
    sigma = np.empty((height, width), np.float32)
    amplitude = np.empty((height, width), np.float32)
    mean = np.empty((height, width), np.float32)
    clipped = np.zeros((height, width), np.bool_)
    for r in prange(height):
        a, b, total = np.zeros(width), np.zeros(width), np.zeros(width)
        # second harmonics of the values: what shot noise, proportional to the light, needs
        a2, b2 = np.zeros(width), np.zeros(width)
        for n in range(steps):
            cn, sn = cosine[n], sine[n]
            for c in range(width):
                value = float(images[n, r, c])
                a[c] += value * cn
                b[c] += value * sn
                total[c] += value
                light = max(value - black, 0.0)
                a2[c] += light * (cn * cn - sn * sn)
                b2[c] += light * 2.0 * cn * sn
                if images[n, r, c] >= saturation:
                    clipped[r, c] = True
        for c in range(width):
            radius2 = a[c] * a[c] + b[c] * b[c]
            offset[r, c] = (np.arctan2(b[c], a[c]) % (2.0 * np.pi)) * px_per_rad
            amplitude[r, c] = 2.0 * np.sqrt(radius2) / steps
            mean[r, c] = total[c] / steps
            # variance of the component across (a, b): sum of var_n sin²(turn_n - phase)
            light = max(total[c] - steps * black, 0.0)
            across = 0.0
            if radius2 > 0.0:
                across = (a2[c] * (a[c] * a[c] - b[c] * b[c]) + 2.0 * b2[c] * a[c] * b[c]) / radius2
            variance = 0.5 * (gain * max(light - across, 0.0) + floor * steps)
            sigma[r, c] = px_per_rad * np.sqrt(variance / radius2) if radius2 > 0.0 else np.inf
    return offset, sigma, amplitude, mean, clipped
