"""Reading a round of stripes: a matched filter along the epipolar line.

A pixel's phasors, one per frequency, are compared with those that each column on its epipolar line predicts.
The sum is coherent: direct light adds up at one column, noise and interreflected light do not.
Around the best column the maximum-likelihood fit of column, row and amplitude gives the result; how badly the
phasors phasors fit widens its sigma and divides the lead over the second best column.

Most pixels look next to where their neighbour on the left looks, and there it is searched first. What the
best column there leaves of the phasors' power bounds what any other column can gain: where that bound is far
behind, the rest of the line need not be searched.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numba import njit, prange

from burrscan.arrays import Bools, Complexes, Floats, Floats32, Image
from burrscan.codes.phase import sheet_of
from burrscan.devices import CameraSheet
from burrscan.rig import Rig
from burrscan.scan.matching.epipolar import epipolar_nodes
from burrscan.scan.matching.phasors import phasors, turns_of
from burrscan.scan.stripes import Stripes

_GRID_PX = 1.5
"""Step of the search: within half of it from the true column even the finest stripes (6.5 px) keep 3/4 of
their match."""
_MAIN_LOBE_PX = 5.0
"""Half-width of the match's peak, a little over half the mean period (9.2 px): what is farther is another
column. As in stripes.py."""
_DETECTION_Z = 4.0
"""Standard deviations of chi² by which the phasors' power must exceed its mean under noise alone."""
MODULATION_ERROR = 0.02
"""Relative error of an amplitude beside its line in frequency squared: bright pixels' noise would hold the
line too tightly."""
_INDIRECT_GUESS = 0.15
"""Share of the interreflected light that may be modulated, in ways unknown: a phasor's standard deviation
by it."""
LEAST_FREQUENCIES = 5
"""Ten numbers for four unknowns: column, row, amplitude and its loss with frequency; fewer hardly tell a
misfit."""
_ILL_FITTING = 12.0
"""Chi² per degree of freedom from which errors are not noise's, so that the lead in chi² is worth less."""
_NEAR_PX = 3.0
"""To either side of the neighbour's column: where the surface goes on, the column changes by less."""
_SIDE_LOBE = 0.75
"""Match at a wrong column, at most: six and more frequencies on 1024 columns stay below (0.71); five reach
0.80."""
SURE_LEAD = 45.0
"""In chi²: above the 42 (three times 14) that even ill-fitting pixels need, so that nothing is taken that the
search of the whole line would refuse."""
_CONVERGED_PX = 1e-3
"""Far below the noise of any column; the last Gauss-Newton steps shrink by orders."""
FOOTPRINT_PX2 = 0.15
"""Half the variance of the footprint: the squares of camera and projector pixel are a sixth px², blur the
rest of 0.3."""
_FOOTPRINT_ERROR_PX2 = 0.05
"""How surely that is known, so that it only decides where a pixel's own amplitudes do not."""


@dataclass(frozen=True)
class Reading:
    """One round, decoded; all (h, w), NaN where nothing was detected.

    Parameters
    ----------
    u_px, v_px, sigma_u_px, sigma_v_px
        Column and row, each with its stated sigma.
    direct_e
        Electrons that full light adds directly.
    lost
        Interreflected light per direct light, at least: what full light shows beyond the
        stripes' modulation.
    misfit
        chi² per degree of freedom of the phasors.
    lead
        By how much the second best column fits worse, chi² in units of ``misfit`` or, if larger, of noise.
    off_line_px
        Distance of the fitted row from the epipolar line.
    clipped
        True where a frame was clipped.

    """

    u_px: Floats32
    v_px: Floats32
    sigma_u_px: Floats32
    sigma_v_px: Floats32
    direct_e: Floats32
    lost: Floats32
    misfit: Floats32
    lead: Floats32
    off_line_px: Floats32
    clipped: Bools

    def blanked(
        self,
        *,
        max_sigma_px: float,
        least_lead: float = 14.0,
        off_line_px: float = 1.5,
    ) -> Reading:
        """The same with NaN where the column is coarse or ambiguous, or its row off the line.

        A row may be ``off_line_px`` off for an imperfect calibration, and four sigmas more. Where the phasors
        fit badly their errors are not noise, and the second best column must be thrice as far behind.
        """
        with np.errstate(invalid="ignore"):
            needed = np.where(self.misfit > _ILL_FITTING, 3.0 * least_lead, least_lead)
            fine = (self.sigma_u_px <= max_sigma_px) & (self.lead >= needed)
            fine &= np.abs(self.off_line_px) <= off_line_px + 4.0 * self.sigma_v_px
        return self.without(np.asarray(~fine))

    def without(self, pixels: Bools) -> Reading:
        """The same with NaN at ``pixels``."""
        names = ("u_px", "v_px", "sigma_u_px", "sigma_v_px")
        nan = np.float32(np.nan)
        return replace(self, **{name: np.where(pixels, nan, getattr(self, name)) for name in names})


def read(images: Image, code: Stripes, *, camera: CameraSheet, rig: Rig, dark_e: Floats32) -> Reading:
    """Decode a round.

    Parameters
    ----------
    images
        (F, h, w) DN, in the order of the stripes' frames.
    code
        What was shown.
    camera, rig
        The noise model and the epipolar lines.
    dark_e
        (h, w) electrons under a black projector at the round's exposure.

    Notes
    -----
    O(lit pixels · K · columns / 2 px). Frequencies with a clipped frame are left out.

    """
    gain = camera.gain_dn_per_e
    planes, clipped = _read(
        images,
        2.0 * np.pi * code.per_column,
        2.0 * np.pi * code.per_row,
        epipolar_nodes(rig),
        dark_e * np.float32(gain),
        sheet_of(camera),
        rig.projector.width,
    )
    u, v, sigma_u, sigma_v, amplitude, lost, misfit, lead, off_line = planes
    direct_e = amplitude * np.float32(2.0 / gain)
    return Reading(u, v, sigma_u, sigma_v, direct_e, lost, misfit, lead, off_line, clipped)


@njit(cache=True, parallel=True, nogil=True)
def _read(
    images: Image, f: Floats, g: Floats, nodes: Floats32, dark: Floats32, sheet: Floats, columns: int
) -> tuple[Floats32, Bools]:
    _, height, width = images.shape
    planes = np.full((9, height, width), np.nan, np.float32)
    turns = turns_of(images.shape[0] // len(f))
    clipped = np.zeros((height, width), np.bool_)
    for r in prange(height):
        z, variance = np.empty(len(f), np.complex128), np.empty(len(f))
        for c in range(width):
            # the loop's own index is unsigned
            mean, usable = phasors(images, np.int64(r), c, sheet, turns, z, variance)
            clipped[r, c] = usable < len(f)
            if usable < LEAST_FREQUENCIES or not _detected(z, variance, usable):
                continue
            noise = variance[np.isfinite(variance)].mean()
            unknown = (_INDIRECT_GUESS * _indirect(z, noise, mean, dark[r, c])) ** 2
            whole, line, lead = variance + unknown, nodes[r, c], 0.0
            hint = planes[0, r, c - 1] if c > 0 else np.nan
            if np.isfinite(hint):
                u, row, best, _ = _search(z, whole, f, g, line, max(hint - _NEAR_PX, -0.5), hint + _NEAR_PX)
                lead = _least_lead(best, (np.abs(z) ** 2 / whole).sum())
            if lead < SURE_LEAD:
                u, row, best, second = _search(z, whole, f, g, line, -0.5, columns - 0.5)
                lead = best - second
            if best <= 0.0:
                continue
            u, v, amplitude, plain, var_u, var_v, misfit = _fit(z, variance, f, g, u, row)
            # phasors that fit nowhere, of a part that shook, may send the steps anywhere
            if not (amplitude > 0.0 and -0.5 - _NEAR_PX <= u <= columns - 0.5 + _NEAR_PX):
                continue
            wider = max(misfit, 1.0)
            planes[0, r, c], planes[1, r, c] = u, v
            planes[2, r, c], planes[3, r, c] = np.sqrt(var_u * wider), np.sqrt(var_v * wider)
            planes[4, r, c] = amplitude
            planes[5, r, c] = max((mean - dark[r, c]) / plain - 1.0, 0.0)
            planes[6, r, c] = misfit
            planes[7, r, c] = lead * (1.0 + unknown / noise) / wider
            planes[8, r, c] = v - _row_at(line, u, row)
    return planes, clipped


@njit(cache=True, nogil=True)
def _detected(z: Complexes, variance: Floats, usable: int) -> bool:
    """Whether the phasors together are longer than noise makes them."""
    power = (np.abs(z) ** 2 / variance).sum()
    return bool(power > 2.0 * usable + _DETECTION_Z * np.sqrt(4.0 * usable))


@njit(cache=True, nogil=True)
def _indirect(z: Complexes, noise: float, mean: float, dark: float) -> float:
    """Light at full white that neither the median modulation nor the dark nor noise explains."""
    beyond: float = 2.0 * (mean - dark - np.median(np.abs(z))) - 4.0 * np.sqrt(noise)
    return max(beyond, 0.0)


@njit(cache=True, nogil=True, fastmath={"reassoc", "contract", "nsz"})
def _search(
    z: Complexes, variance: Floats, f: Floats, g: Floats, nodes: Floats32, first: float, last: float
) -> tuple[float, float, float, float]:
    """Best column from first to last and its row on the epipolar polyline; its gain in chi², the next best's.

    From step to step every phasor turns back by its own angle.
    """
    sums = np.zeros(int((last - first) / _GRID_PX) + 4 * len(nodes), np.float32)
    places = np.empty(len(sums), np.float32)
    n = 0
    for s in range(len(nodes) - 1):
        u0, v0, u1, v1 = nodes[s, 0], nodes[s, 1], nodes[s + 1, 0], nodes[s + 1, 1]
        start, stop = max(u0, first), min(u1, last)
        if not (u1 > u0 and stop > start):
            continue
        slope = (v1 - v0) / (u1 - u0)
        turned = z / variance * np.exp(-1j * (f * start + g * (v0 + slope * (start - u0))))
        turn = np.exp(-1j * _GRID_PX * (f + g * slope))
        for i in range(min(int((stop - start) / _GRID_PX) + 1, len(sums) - n)):
            total = 0.0
            for j in range(len(turned)):
                total += turned[j].real
                turned[j] *= turn[j]
            sums[n], places[n] = total, start + i * _GRID_PX
            n += 1
    if n == 0 or not sums.max() > 0.0:
        return np.nan, np.nan, -1.0, 0.0
    at = np.argmax(sums[:n])
    second = 0.0
    for i in range(n):
        if abs(places[i] - places[at]) > _MAIN_LOBE_PX:
            second = max(second, sums[i])
    u, weight = places[at], (1.0 / variance).sum()
    return u, _row_at(nodes, u, 0.0), sums[at] ** 2 / weight, second**2 / weight


@njit(cache=True, nogil=True)
def _least_lead(gain: float, power: float) -> float:
    """What a column's gain in chi² is ahead of any other's, at least; 0 where that cannot be told.

    With a share p of the power P at the best column, and templates of any other column that match it to no
    more than s, the other gains at most P (s √p + √(1 - s²) √(1 - p))².
    """
    share = min(gain / power, 1.0)
    if share <= _SIDE_LOBE**2:
        return 0.0
    other = _SIDE_LOBE * np.sqrt(share) + np.sqrt((1.0 - _SIDE_LOBE**2) * (1.0 - share))
    return float((share - other * other) * power)


@njit(cache=True, nogil=True)
def _row_at(nodes: Floats32, u: float, otherwise: float) -> float:
    """Row of the epipolar polyline at a column."""
    for s in range(len(nodes) - 1):
        u0, v0, u1, v1 = nodes[s, 0], nodes[s, 1], nodes[s + 1, 0], nodes[s + 1, 1]
        if u1 > u0 and u0 - 1.0 <= u <= u1 + 1.0:
            row: float = v0 + (v1 - v0) / (u1 - u0) * (u - u0)
            return row
    return otherwise


@njit(cache=True, nogil=True)
def _fit(
    z: Complexes, variance: Floats, f: Floats, g: Floats, u: float, v: float
) -> tuple[float, float, float, float, float, float, float]:
    """Maximum likelihood of column, row and amplitude by Gauss-Newton.

    Returns them, the amplitude that unblurred stripes would have, the variances, and chi² per dof.
    """
    amplitude, plain, iuu, ivv, misfit = 0.0, 0.0, np.inf, np.inf, np.inf
    turned = np.empty_like(z)
    for _ in range(4):
        s, w = 0.0, 0.0
        for j in range(len(z)):
            angle = f[j] * u + g[j] * v
            turned[j] = z[j] * complex(np.cos(angle), -np.sin(angle))
            s += turned[j].real / variance[j]
            w += 1.0 / variance[j]
        amplitude = s / w
        if not amplitude > 0.0:
            break
        auu, auv, avv, bu, bv, chi2, dof = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -4.0
        s0, sq, sqq, sa, saq, saa = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for j in range(len(z)):
            along, across = turned[j].real, turned[j].imag
            k = 1.0 / variance[j]
            auu += k * f[j] * f[j]
            auv += k * f[j] * g[j]
            avv += k * g[j] * g[j]
            bu += k * f[j] * across
            bv += k * g[j] * across
            chi2 += across * across * k
            dof += 2.0 if k > 0.0 else 0.0
            # finer stripes lose modulation: the amplitudes are fitted by a line in frequency squared
            q = f[j] * f[j] + g[j] * g[j]
            k /= 1.0 + k * (MODULATION_ERROR * amplitude) ** 2
            s0 += k
            sq += k * q
            sqq += k * q * q
            sa += k * along
            saq += k * along * q
            saa += k * along * along
        det = auu * avv - auv * auv
        if not det > 0.0:
            break
        du = (avv * bu - auv * bv) / (det * amplitude)
        dv = (auu * bv - auv * bu) / (det * amplitude)
        u, v = u + du, v + dv
        iuu, ivv = avv / (det * amplitude**2), auu / (det * amplitude**2)
        cqq, caq = sqq - sq * sq / s0, saq - sa * sq / s0
        chi2 += max(saa - sa * sa / s0 - (caq * caq / cqq if cqq > 0.0 else 0.0), 0.0)
        misfit = chi2 / dof
        # what stripes without loss of modulation would have: the line's intercept, its slope held near that
        # of a footprint one pixel wide
        held = 1.0 / (_FOOTPRINT_ERROR_PX2 * amplitude) ** 2
        slope = (caq - FOOTPRINT_PX2 * amplitude * held) / (cqq + held)
        plain = (sa - slope * sq) / s0
        if abs(du) + abs(dv) < _CONVERGED_PX:
            break
    return u, v, amplitude, plain, iuu, ivv, misfit
