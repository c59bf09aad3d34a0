"""The intensity each projector pixel may use, chosen for all the camera pixels that see it.

For every projector pixel and every intensity of a ladder, the expected squared error of the camera pixels
nearby is summed: too much light clips the bright ones, too little leaves the dim ones to noise. The
intensity with the smallest sum wins. A pixel that an earlier round has measured well loses little by being
clipped now, so it does not hold its dim neighbours back.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from scipy import ndimage

from burrscan.arrays import Bools, Floats, Floats32
from burrscan.devices import CameraSheet
from burrscan.scan.exposure import Response, sine_sigma_px

_SMOOTH_PX = 1.5
"""Standard deviation of the blur, projector px: a step of intensity within a stripe (6.5 px and more) would
shift its phase."""


def intensity_ladder(*, least: float, rungs: int = 14) -> Floats:
    """Intensities from 1 down to ``least`` in even ratios."""
    return np.geomspace(1.0, least, rungs)


def intensities(
    u_px: Floats32,
    v_px: Floats,
    response: Response,
    known_sigma_px: Floats32,
    *,
    shape: tuple[int, int],
    camera: CameraSheet,
    exposure_ms: float,
    period_px: float,
    steps: int,
    max_sigma_px: float,
    least: float,
) -> Floats:
    """Choose the intensity of each projector pixel.

    Parameters
    ----------
    u_px, v_px
        (h, w) where each camera pixel looks in the projector, NaN where unknown.
    response
        Of each camera pixel.
    known_sigma_px
        (h, w) sigma already reached, infinite where none.
    shape
        Rows and columns of the projector.
    camera, exposure_ms, period_px, steps
        The coming round.
    max_sigma_px
        A pixel no finer than this counts as lost, at the square of this.
    least
        The dimmest intensity that still carries a pattern.

    Returns
    -------
    ndarray
        (H, W) in least .. 1, smooth over a camera pixel's footprint.

    Notes
    -----
    O(camera pixels · rungs).

    """
    ladder = intensity_ladder(least=least)
    sees = np.isfinite(u_px) & np.isfinite(v_px)
    white = response.white_e_per_ms[sees].astype(float) * exposure_ms
    black = np.clip(response.black_e_per_ms[sees].astype(float) * exposure_ms, 0.0, white)
    before = 1.0 / known_sigma_px[sees].astype(float) ** 2
    costs = np.empty((len(white), len(ladder) + 1), np.float32)
    roof = camera.full_well_e - 4.0 * np.sqrt(camera.full_well_e)
    for rung, dim in enumerate(ladder):
        signal = (white - black) * dim
        sigma = sine_sigma_px(signal, black, camera=camera, period_px=period_px, steps=steps)
        now = np.where(signal + black < roof, 1.0 / sigma**2, 0.0)
        with np.errstate(divide="ignore"):
            costs[:, rung] = np.minimum(1.0 / (before + now), max_sigma_px**2)
    costs[:, -1] = (white - black) * least + black >= roof
    total = np.zeros((*shape, len(ladder) + 1), np.float32)
    _spread(u_px[sees], v_px[sees], costs, total)
    sums, clipped = total[..., :-1], total[..., -1] > 0.0
    # Where nothing is won by any, what clips anyway gets no light: a step beside it would shift phases. What
    # is too dim gets all there is.
    alike = sums.max(axis=-1) == sums.min(axis=-1)
    choice = np.where(alike & clipped, len(ladder) - 1, np.argmin(sums, axis=-1))
    return _smooth(ladder[choice], sums.max(axis=-1) > 0.0)


def _smooth(chosen: Floats, seen: Bools) -> Floats:
    """Where no camera pixel looks the nearest choice holds; then blur the logarithm."""
    if not seen.any():
        return np.ones_like(chosen)
    nearest = ndimage.distance_transform_edt(~seen, return_distances=False, return_indices=True)
    logs = np.log(chosen)[tuple(nearest)]
    return np.exp(ndimage.gaussian_filter(logs, _SMOOTH_PX, mode="nearest"))


@njit(cache=True, nogil=True)
def _spread(u: Floats32, v: Floats, costs: Floats32, total: Floats32) -> None:
    """Add each camera pixel's costs to the projector pixels within its footprint and one around it."""
    height, width, channels = total.shape
    for i in range(len(u)):
        column, row = int(np.rint(u[i])), int(np.rint(v[i]))
        for y in range(max(row - 1, 0), min(row + 2, height)):
            for x in range(max(column - 1, 0), min(column + 2, width)):
                for channel in range(channels):
                    total[y, x, channel] += costs[i, channel]
