"""From light to digital numbers: the linear camera of EMVA 1288."""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from burrscan.arrays import Floats32, Image
from scenes.electronics.spec import CameraSpec
from scenes.electronics.streams import normal_pair, stream_key, uniform

_SMALL_MEAN = 30.0
"""Below this the Poisson variate is exact, by inversion; above, a Cornish-Fisher expansion."""


@nb.njit(cache=True)
def _poisson_by_inversion(mean: float, u: float) -> float:
    probability = math.exp(-mean)
    total, count = probability, 0
    while u > total and count < 200:
        count += 1
        probability *= mean / count
        total += probability
    return float(count)


@nb.njit(cache=True, parallel=True)
def _expose(
    light: Floats32,
    rate: float,
    gain: float,
    black: float,
    full_well: float,
    read_noise: float,
    top: float,
    shot_key: np.uint64,
    read_key: np.uint64,
    first: int,
) -> Image:
    frames, pixels = light.shape
    images = np.empty((frames, pixels), np.uint16)
    for block in nb.prange(frames * 16):
        f, part = block // 16, block % 16
        for p in range(part * pixels // 16, (part + 1) * pixels // 16):
            counter = np.uint64((first + f) * pixels + p)
            mean = rate * light[f, p]
            read, shot = 0.0, 0.0
            if mean < _SMALL_MEAN:
                read, _ = normal_pair(read_key, counter)
                electrons = _poisson_by_inversion(mean, uniform(shot_key, counter)) if mean > 0.0 else 0.0
            else:
                read, _ = normal_pair(read_key, counter)
                shot, _ = normal_pair(shot_key, counter)
                electrons = math.floor(mean + shot * math.sqrt(mean) + (shot * shot - 1.0) / 6.0 + 0.5)
            value = black + gain * (min(electrons, full_well) + read_noise * read)
            images[f, p] = np.uint16(min(max(math.floor(value + 0.5), 0.0), top))
    return images


def expose(
    light: Floats32, *, camera: CameraSpec, exposure_ms: float, identity: tuple[int, ...], first_frame: int
) -> Image:
    """Digital images of light.

    Parameters
    ----------
    light
        (F, h, w) light; 1 fills the well in ``camera.white_exposure_ms``.
    camera
        The electronics.
    exposure_ms
        Exposure time.
    identity, first_frame
        Which case, and how many pictures were taken before: they fix the noise. Shot and read noise have
        streams of their own.

    Returns
    -------
    (F, h, w) DN. O(F h w).

    """
    sheet = camera.sheet
    frames, *shape = light.shape
    images: Image = _expose(
        light.reshape(frames, -1),
        camera.electrons_per_ms * exposure_ms,
        sheet.gain_dn_per_e,
        sheet.black_level_dn,
        sheet.full_well_e,
        sheet.read_noise_e,
        float(sheet.saturation_dn),
        stream_key(identity, "shot noise"),
        stream_key(identity, "read noise"),
        first_frame,
    )
    return images.reshape(frames, *shape)
