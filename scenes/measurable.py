"""The physical limit: how well the best possible scan could measure each camera pixel.

The yardstick is an 8-step sine of 16 projector pixels at the brightest light and the longest exposure that do
not saturate the pixel. Its Cramér-Rao bound on the projector column is ``P / (2π) · sqrt(2 / N) · σ / A``,
with A the amplitude of the modulated direct light and σ the noise at its mean level, in electrons (see e.g.
Bouquet, Thorstensen, Bakke & Risholm 2017, eq. 9).
"""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Bools, Floats32
from scenes.electronics.spec import CameraSpec
from scenes.light import Light

_PERIOD_PX = 16.0
"""Of the sine that the limit is stated for, projector px: a usual finest stripe."""
_STEPS = 8
"""Of that sine. More frames would lower the limit; so many are the price of a usual scan."""
LIMIT_PX = 0.5
"""Standard deviation, and spread of the footprint, up to which a pixel has one column: half of one."""


def limit_sigma_px(light: Light, *, camera: CameraSpec, ambient: float) -> Floats32:
    """Smallest standard deviation (h, w) of the projector column, pixels; infinite without direct light.

    Parameters
    ----------
    light
        The scene's light.
    camera
        Electronics; its longest and shortest exposures are the permitted ones.
    ambient
        Radiance of the surround.

    """
    rate = camera.electrons_per_ms
    direct, steady = light.white_direct * rate, light.ambient * (ambient * rate)
    peak = direct + light.white_indirect * rate + steady
    with np.errstate(divide="ignore", invalid="ignore"):
        exposure = np.clip(camera.full_well_e / peak, camera.shortest_ms, camera.longest_ms)
        share = np.clip((camera.full_well_e - exposure * steady) / (exposure * (peak - steady)), 0.0, 1.0)
    share = np.nan_to_num(share)
    exposure = np.nan_to_num(exposure)
    amplitude = 0.5 * exposure * share * direct
    mean = 0.5 * exposure * share * (peak - steady) + exposure * steady
    noise = np.sqrt(camera.variance_e2(mean))
    scale = _PERIOD_PX / (2.0 * np.pi) * np.sqrt(2.0 / _STEPS)
    with np.errstate(divide="ignore"):
        return np.where(amplitude > 0.0, scale * noise / amplitude, np.inf).astype(np.float32)


def measurable(light: Light, limit_px: Floats32) -> Bools:
    """Pixels (h, w) that light of the permitted intensity could measure to 0.5 px at best.

    Photons must suffice, and the pixel must have one projector coordinate to begin with: where its footprint
    is torn over a depth edge (a spread of more than 0.5 px) no decoder can name one.
    """
    one_place = np.nan_to_num(light.spread_px, nan=np.inf) <= LIMIT_PX
    result: Bools = (limit_px <= LIMIT_PX) & one_place
    return result
