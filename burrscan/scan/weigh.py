"""One column from several stripe periods, each weighed by what is known against it.

Beside the camera's noise, light that came by way of other surfaces moves a phase. How much of it there is the
pixel itself tells (what full light adds beyond the direct modulation); how far it moves a phase per unit of
its share depends on the scene, and is learnt from how much the periods contradict each other.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange
from scipy import stats

from burrscan.arrays import Floats, Floats32

_LEARN_FROM = 30_000
_LEAST_TO_LEARN = 500
_UNLEARNT_RAD = 0.1
_MOST_RAD = 2.0
_COMPACT_PX2 = 1.0
_MODULATION_ERROR = 0.02


def weigh(
    offset_px: Floats32,
    sigma_px: Floats32,
    amplitude: Floats32,
    *,
    periods_px: Floats,
    near_px: Floats32,
    share: Floats32,
) -> tuple[Floats32, Floats32, Floats32]:
    """Fuse the periods' phases around known stripes.

    Parameters
    ----------
    offset_px, sigma_px, amplitude
        (P, h, w) phases of each period, see :class:`burrscan.codes.phase.Phase`.
    periods_px
        (P,)
    near_px
        (h, w) the column to well within half a period, NaN where unknown.
    share
        (h, w) light by way of other surfaces, per direct light.

    Returns
    -------
    u_px, sigma_px, torn
        (h, w) the column, its standard deviation, and chi² of the modulations against a compact footprint.

    Notes
    -----
    O(P · pixels). Sigma is the weighted mean's, widened where the periods contradict each other by more
    than chance would (Birge 1932).

    """
    wobble = learn_wobble_rad(offset_px, sigma_px, periods_px=periods_px, near_px=near_px, share=share)
    u, sigma, torn = _weigh(offset_px, sigma_px, amplitude, periods_px, near_px, share, wobble)
    return u, sigma, torn


def learn_wobble_rad(
    offset_px: Floats32, sigma_px: Floats32, *, periods_px: Floats, near_px: Floats32, share: Floats32
) -> float:
    """Phase error (radians) per unit of indirect share that makes the periods' scatter what it should be.

    The scatter's chi² over the pixels in which indirect light may matter is brought to its median; 0 where
    noise explains it, a middling value where too few pixels tell.
    """
    finest = np.min(sigma_px * (2.0 * np.pi / periods_px[:, None, None]), axis=0)
    with np.errstate(invalid="ignore"):
        telling = np.flatnonzero(np.isfinite(near_px) & (share < 1.0) & (share > finest) & (finest < 0.1))
    if len(telling) < _LEAST_TO_LEARN:
        return _UNLEARNT_RAD
    telling = telling[:: 1 + len(telling) // _LEARN_FROM]
    offset, sigma = (stack.reshape(len(periods_px), -1)[:, telling] for stack in (offset_px, sigma_px))
    gap = offset - near_px.ravel()[telling]
    gap -= periods_px[:, None] * np.rint(gap / periods_px[:, None])
    per_rad = periods_px[:, None] / (2.0 * np.pi) * share.ravel()[telling]
    expected = float(stats.chi2.median(len(periods_px) - 1))
    low, high = 0.0, _MOST_RAD
    if _median_chi2(gap, sigma**2) <= expected:
        return 0.0
    for _ in range(20):
        middle = 0.5 * (low + high)
        over = _median_chi2(gap, sigma**2 + (middle * per_rad) ** 2) > expected
        low, high = (middle, high) if over else (low, middle)
    return high


def _median_chi2(gap: Floats, variance: Floats) -> float:
    information = 1.0 / variance
    mean = (gap * information).sum(axis=0) / information.sum(axis=0)
    return float(np.median(((gap - mean) ** 2 * information).sum(axis=0)))


@njit(cache=True, parallel=True, nogil=True)
def _weigh(  # noqa: PLR0917 (a kernel)
    offset: Floats32,
    sigma: Floats32,
    amplitude: Floats32,
    periods: Floats,
    near: Floats32,
    share: Floats32,
    wobble: float,
) -> tuple[Floats32, Floats32, Floats32]:
    count, height, width = offset.shape
    out_u = np.full((height, width), np.nan, np.float32)
    out_sigma = np.full((height, width), np.nan, np.float32)
    torn = np.zeros((height, width), np.float32)
    for r in prange(height):
        gap, weight = np.empty(count), np.empty(count)
        for c in range(width):
            if not np.isfinite(near[r, c]):
                continue
            information, moment = 0.0, 0.0
            for j in range(count):
                gap[j] = offset[j, r, c] - near[r, c]
                gap[j] -= periods[j] * np.rint(gap[j] / periods[j])
                moved = wobble * periods[j] / (2.0 * np.pi) * share[r, c]
                weight[j] = 1.0 / (float(sigma[j, r, c]) ** 2 + moved * moved)
                information += weight[j]
                moment += weight[j] * gap[j]
            mean = moment / information
            chi2 = 0.0
            for j in range(count):
                chi2 += weight[j] * (gap[j] - mean) ** 2
            out_u[r, c] = near[r, c] + mean
            out_sigma[r, c] = np.sqrt(max(1.0, chi2 / (3.0 * max(count - 1, 1))) / information)
            torn[r, c] = _torn(amplitude[:, r, c], sigma[:, r, c], periods, wobble * share[r, c])
    return out_u, out_sigma, torn


@njit(cache=True, nogil=True)
def _torn(amplitude: Floats32, sigma: Floats32, periods: Floats, moved_rad: float) -> float:
    """Least chi² of ln A = const - s² ω² / 2 over compact footprints, 0 <= s² <= 1 px²."""
    s, sx, sy, sxx, sxy, syy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(len(periods)):
        if not amplitude[j] > 0.0:
            return np.inf
        omega = 2.0 * np.pi / periods[j]
        # relative error of an amplitude equals the error of its phase in radians
        weight = 1.0 / ((omega * sigma[j]) ** 2 + moved_rad**2 + _MODULATION_ERROR**2)
        x, y = -0.5 * omega * omega, np.log(amplitude[j])
        s += weight
        sx += weight * x
        sy += weight * y
        sxx += weight * x * x
        sxy += weight * x * y
        syy += weight * y * y
    # centred sums, then the slope s² held within its bounds
    sxx -= sx * sx / s
    sxy -= sx * sy / s
    syy -= sy * sy / s
    slope = min(max(sxy / sxx, 0.0), _COMPACT_PX2) if sxx > 0.0 else 0.0
    least: float = max(syy - 2.0 * slope * sxy + slope * slope * sxx, 0.0)
    return least
