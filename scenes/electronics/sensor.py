"""From light to digital numbers: the camera of EMVA 1288, linear or with a response curve."""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from burrscan.arrays import Floats, Floats32, Image
from scenes.electronics.spec import CameraSpec
from scenes.streams import normal_pair, stream_key, uniform

_BLOCKS = 16  # parts of a frame that threads take in turn
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


@nb.njit(cache=True)
def _electrons(mean: float, normal: float, key: np.uint64, counter: np.uint64, side: int) -> float:
    """A Poisson variate: by a standard normal value where the mean is large, else by a uniform one."""
    if mean >= _SMALL_MEAN:
        return math.floor(mean + normal * math.sqrt(mean) + (normal * normal - 1.0) / 6.0 + 0.5)
    if mean <= 0.0:
        return 0.0
    u = uniform(key, np.uint64(2) * counter + np.uint64(side))
    return float(_poisson_by_inversion(mean, u))


@nb.njit(cache=True)
def _bent(share: float, curve: Floats) -> float:
    """Output of a share of the full well by a curve's evenly spaced knots, straight on below the dark."""
    place = min(share, 1.0) * (len(curve) - 1)
    low = min(max(int(place), 0), len(curve) - 2)
    return float(curve[low] + (place - low) * (curve[low + 1] - curve[low]))


@nb.njit(cache=True, parallel=True)
def _expose(
    light: Floats32,
    rate: float,
    dark: float,
    gain: float,
    black: float,
    full_well: float,
    read_noise: float,
    top: float,
    shot_key: np.uint64,
    read_key: np.uint64,
    first: int,
    curve: Floats,
) -> Image:
    frames, pixels = light.shape
    pairs = (pixels + 1) // 2  # normal values come in pairs: two neighbours share one
    images = np.empty((frames, pixels), np.uint16)
    for block in nb.prange(frames * _BLOCKS):
        f, part = block // _BLOCKS, block % _BLOCKS
        for pair in range(part * pairs // _BLOCKS, (part + 1) * pairs // _BLOCKS):
            counter = np.uint64((first + f) * pairs + pair)
            read = normal_pair(read_key, counter)
            last = min(2 * pair + 1, pixels - 1)
            bright = dark + rate * max(light[f, 2 * pair], light[f, last]) >= _SMALL_MEAN
            shot = normal_pair(shot_key, counter) if bright else (0.0, 0.0)
            for p in range(2 * pair, last + 1):
                side = p - 2 * pair
                electrons = min(
                    _electrons(dark + rate * light[f, p], shot[side], shot_key, counter, side), full_well
                )
                analogue = electrons + read_noise * read[side]
                analogue = full_well * _bent(analogue / full_well, curve) if len(curve) else analogue
                value = black + gain * analogue
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
        1e-3 * camera.dark_current_e_per_s * exposure_ms,
        sheet.gain_dn_per_e,
        sheet.black_level_dn,
        sheet.full_well_e,
        sheet.read_noise_e,
        float(sheet.saturation_dn),
        stream_key(identity, "shot noise"),
        stream_key(identity, "read noise"),
        first_frame,
        np.empty(0) if camera.response.linear else camera.response.knots,
    )
    return images.reshape(frames, *shape)
