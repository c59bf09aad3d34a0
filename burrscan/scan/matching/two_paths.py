"""Two paths to a pixel: light that comes directly, and light that comes by way of another surface.

A burr's flank on metal lies dark beside a bright wheel and mirrors it: most of its light may be the wheel's,
whose columns are a few beside its own. One path then explains the phasors badly, and its column lies between
both, or at the mirrored one. Two explain them: direct light at one column, the other spread over columns to
one side of it, of which the finer stripes lose more. What is spread is not direct.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numba import njit, prange

from burrscan.arrays import Complexes, Floats, Floats32, Image, Ints
from burrscan.codes.phase import sheet_of
from burrscan.devices import CameraSheet
from burrscan.rig import Rig
from burrscan.scan.matching.matched import FOOTPRINT_PX2, MODULATION_ERROR, Reading
from burrscan.scan.matching.phasors import phasors, turns_of
from burrscan.scan.stripes import Stripes
from burrscan.shifted import shifted
from burrscan.triangulation import epipolar_v

_ILL = 2.0
"""Chi² per degree of freedom of one path from which another is sought, or over the median of all pixels where
that is more: flicker makes phasors fit badly everywhere."""
_BETTER = 2.5
"""Times by which two paths must leave less than one. On 22 rendered wheels 2 finds second paths at a lobe's
border, where none is, and 3.5 leaves more flanks where they were."""
_LEAST_LEAD = 14.0
"""In chi², in units of the misfit: by so much any other column must be worse, as for one path."""
_LEAST_SHARE = 0.1
"""Of the other path's light over the direct: less moves no column by more than noise."""
_BEYOND_FOOTPRINT = 1.5
"""Columns that a pixel sees, by which the other path must be away: at a limb, or a step, a pixel sees two
places, both directly. A step counts for three columns at most, for what is read beside it may be wrong."""
_WIDEST_STEP_PX = 3.0
"""See above."""
_LEFT = 0.3
"""Interreflected over direct light that a pixel is held to have once its paths are apart."""
_NEAR_PX = 1.5
"""Light from nearer columns is not told from direct: a quarter of the finest stripe."""
_ROWS_PX2 = 1.5
"""Variance of the rows by which interreflected light is spread: 0.6 to 2.2 px on rendered flanks."""
_FAR_PX = 8.0
"""How far the other path is expected to be, one standard deviation."""
_PLACES = np.arange(-12.0, 12.01, 0.6)
"""Columns tried for the direct path, from that of one path: steps of a tenth of the finest stripe."""
_APART = np.array([0.8, 1.5, 2.5, 4.0, 6.0, 9.0, 12.0])
"""Columns tried between both paths, to either side."""
_BREADTHS = np.array([0.2, 0.45, 0.8])
"""Spreads tried of the other path, over how far it is."""
_NARROWEST, _BROADEST = 0.12, 1.0
"""Of that spread: from a mirror's to an exponential that begins at the direct path."""
_BREADTH_SIGMA = 0.3
"""Of what is known of it beforehand."""
_TRIED = 4
"""Columns from which the fit starts, the best first."""
_DISTINCT_PX = 1.5
"""Between them; and, less half a pixel, between fits that are different answers."""
_STEPS = 25
"""Bounds Levenberg-Marquardt on five parameters, which ends by itself once a step gains a hundredth."""


class _Paths(NamedTuple):
    """What is told of both paths, per pixel (N,).

    The direct column from that of one path and its sigma, px; chi² of one path, of both, and of the next best
    both; how far the other path is, px, and its light over the direct.
    """

    shift_px: Floats
    sigma_px: Floats
    one: Floats
    both: Floats
    next: Floats
    apart_px: Floats
    share: Floats


def direct_of_two(
    images: Image, code: Stripes, reading: Reading, *, camera: CameraSheet, rig: Rig
) -> Reading:
    """The reading with the direct path's column where two paths explain a pixel and one does not.

    Parameters
    ----------
    images
        (F, h, w) DN, in the order of the stripes' frames.
    code
        What was shown.
    reading
        One path's, of the same round.
    camera, rig
        The noise model and the epipolar lines.

    Notes
    -----
    Both paths are one epipolar line's (two sharp ones: "bimodal multipath", arXiv 1706.02715). The other
    one's light is gamma-distributed over columns from the direct one on, of mean D and relative spread b: at
    F radians a column its phasor is (1 - i F D b²)^(-1/b²). What lies within a quarter stripe of the direct
    column is not told from it, and its sigma says so. O(pixels that fit badly · places · distances · spreads
    · frequencies), a sixth of a millisecond each.

    """
    known = np.isfinite(reading.u_px)
    usual = float(np.median(reading.misfit[known])) if known.any() else 0.0
    with np.errstate(invalid="ignore"):
        rows, columns = np.nonzero(known & (reading.misfit > _ILL * max(usual, 1.0)))
    if not len(rows):
        return reading
    on_line = np.full(reading.u_px.shape, np.nan)
    on_line[rows, columns] = reading.u_px[rows, columns]
    row_px, next_row_px = (epipolar_v(on_line + by, rig)[rows, columns] for by in (0.0, 1.0))
    lined = np.isfinite(row_px) & np.isfinite(next_row_px)
    rows, columns, row_px, slope = rows[lined], columns[lined], row_px[lined], (next_row_px - row_px)[lined]
    u = reading.u_px[rows, columns].astype(np.float64)
    f, g = 2.0 * np.pi * code.per_column, 2.0 * np.pi * code.per_row
    z, weight = _weighed(images, rows, columns, sheet_of(camera), len(f))
    paths = _Paths(*_both(z * np.exp(-1j * (f * u[:, None] + g * row_px[:, None])), weight, slope, f, g).T)
    misfit = paths.both / np.maximum(2.0 * (weight > 0.0).sum(axis=1) - 5.0, 1.0)
    wider = np.maximum(misfit, 1.0)
    lead = (paths.next - paths.both) / wider
    footprint = np.minimum(_steps(reading.u_px)[rows, columns], _WIDEST_STEP_PX)
    with np.errstate(invalid="ignore"):
        told = (paths.one > _BETTER * paths.both) & (lead > _LEAST_LEAD) & (paths.share > _LEAST_SHARE)
        told &= np.abs(paths.apart_px) > _BEYOND_FOOTPRINT * footprint
    sigma = np.hypot(paths.sigma_px * np.sqrt(wider), _near_px(paths))
    at = rows[told], columns[told]
    values = {
        "u_px": (u + paths.shift_px)[told],
        "v_px": (row_px + slope * paths.shift_px)[told],
        "sigma_u_px": sigma[told],
        "misfit": misfit[told],
        "lead": lead[told],
        "lost": np.minimum(reading.lost[at], _LEFT),
        "off_line_px": np.zeros(len(at[0])),
    }
    return replace(reading, **{name: _with(getattr(reading, name), at, one) for name, one in values.items()})


def _with(plane: Floats32, at: tuple[Ints, Ints], values: Floats) -> Any:
    changed = plane.copy()
    changed[at] = values
    return changed


def _steps(u_px: Floats32) -> Floats32:
    """(h, w) largest difference of a column from those beside it, 0 where none is known."""
    beside = [shifted(u_px, *way) for way in ((0, 1), (0, -1), (1, 0), (-1, 0))]
    steps: Floats32 = np.nan_to_num(np.fmax.reduce([np.abs(one - u_px) for one in beside]))
    return steps


def _near_px(paths: _Paths) -> Floats:
    """(N,) by how much light from beside the direct column may move it: of an exponential as far away."""
    near = 1.0 - np.exp(-_NEAR_PX / np.maximum(np.abs(paths.apart_px), 1e-9))
    return 0.5 * _NEAR_PX * paths.share * near / (1.0 + paths.share * near)


def _weighed(images: Image, rows: Ints, columns: Ints, sheet: Floats, count: int) -> tuple[Complexes, Floats]:
    """(N, K) phasors of some pixels, and one over their variances, a modulation's error included."""
    z, variance = _phasors_at(images, rows, columns, sheet, count)
    beside = (MODULATION_ERROR * np.abs(z).mean(axis=1, keepdims=True)) ** 2
    return z, np.where(np.isfinite(variance), 1.0 / (variance + beside), 0.0)


@njit(cache=True, nogil=True)
def _phasors_at(
    images: Image, rows: Ints, columns: Ints, sheet: Floats, count: int
) -> tuple[Complexes, Floats]:
    z, variance = np.empty((len(rows), count), np.complex128), np.empty((len(rows), count))
    turns = turns_of(images.shape[0] // count)
    for n in range(len(rows)):
        phasors(images, rows[n], columns[n], sheet, turns, z[n], variance[n])
    return z, variance


@njit(cache=True, nogil=True)
def _spread(frequency: Floats, down: Floats, apart: float, breadth: float) -> Complexes:
    """(K,) phasors of interreflected light of one unit, from the direct column."""
    size, turn = frequency * apart * breadth**2, 1.0 / breadth**2
    loss = 0.5 * turn * np.log(1.0 + size * size) + 0.5 * _ROWS_PX2 * down * down
    return np.exp(-loss + 1j * turn * np.arctan(size))


@njit(cache=True, nogil=True)
def _one_path(t: Complexes, weight: Floats, q: Floats) -> float:
    """Chi² of one path at its column, its modulation a line in frequency squared."""
    along = t.real
    s, sq, sqq = weight.sum(), (weight * q).sum(), (weight * q * q).sum()
    sa, saq = (weight * along).sum(), (weight * q * along).sum()
    det = s * sqq - sq * sq
    gain = (sqq * sa * sa - 2.0 * sq * sa * saq + s * saq * saq) / det if det > 0.0 else 0.0
    chi2: float = (weight * np.abs(t) ** 2).sum() - gain
    return chi2


@njit(cache=True, nogil=True)
def _starts(
    t: Complexes, weight: Floats, sharp: Floats, turns: Complexes, nodes: Floats, spreads: Complexes
) -> tuple[Floats, Floats]:
    """(P,) best gain in chi² at each place of the direct path, and (P, 4) the other parameters there."""
    turned, match = weight * t * turns, np.zeros(len(turns))
    gains, others = np.full(len(turns), -1.0), np.zeros((len(turns), 4))
    ss = 0.0
    for k in range(len(t)):
        ss += weight[k] * sharp[k] ** 2
        for a in range(len(turns)):
            match[a] += sharp[k] * turned[a, k].real
    for n in range(len(nodes)):
        oo, so = 0.0, 0.0
        for k in range(len(t)):
            oo += weight[k] * (spreads[n, k].real ** 2 + spreads[n, k].imag ** 2)
            so += weight[k] * sharp[k] * spreads[n, k].real
        det = ss * oo - so * so
        if not det > 1e-6 * ss * oo:
            continue
        for a in range(len(turns)):
            to = 0.0
            for k in range(len(t)):
                to += turned[a, k].real * spreads[n, k].real + turned[a, k].imag * spreads[n, k].imag
            direct, second = (oo * match[a] - so * to) / det, (ss * to - so * match[a]) / det
            gain = direct * match[a] + second * to - (nodes[n, 0] / _FAR_PX) ** 2
            if direct > 0.0 and second > 0.0 and gain > gains[a]:
                gains[a] = gain
                others[a, :2] = nodes[n]
                others[a, 2], others[a, 3] = direct, second
    return gains, others


@njit(cache=True, nogil=True)
def _equations(
    p: Floats, t: Complexes, weight: Floats, frequency: Floats, down: Floats, sharp: Floats
) -> tuple[float, Floats, Floats]:
    """Chi², its gradient and normal matrix, of place, distance, breadth and both amplitudes."""
    place, apart, breadth, direct, second = p
    other = _spread(frequency, down, apart, breadth)
    turn = np.exp(1j * frequency * place)
    size = frequency * apart * breadth**2
    log = 0.5 * np.log(1.0 + size * size) - 1j * np.arctan(size)
    per_apart = 1j * frequency / (1.0 - 1j * size)
    J = np.empty((5, len(t)), np.complex128)
    J[3], J[4] = sharp * turn, other * turn
    model = direct * J[3] + second * J[4]
    J[0] = 1j * frequency * model
    J[1] = second * J[4] * per_apart
    J[2] = second * J[4] * (2.0 / breadth**3 * log + 2.0 * apart / breadth * per_apart)
    off = t - model
    chi2 = (weight * np.abs(off) ** 2).sum() + (apart / _FAR_PX) ** 2
    gradient, normal = np.zeros(5), np.zeros((5, 5))
    for i in range(5):
        gradient[i] = (weight * (J[i].real * off.real + J[i].imag * off.imag)).sum()
        for j in range(5):
            normal[i, j] = (weight * (J[i].real * J[j].real + J[i].imag * J[j].imag)).sum()
    gradient[1] -= apart / _FAR_PX**2
    normal[1, 1] += 1.0 / _FAR_PX**2
    return chi2, gradient, normal


@njit(cache=True, nogil=True)
def _fitted(
    p: Floats, t: Complexes, weight: Floats, frequency: Floats, down: Floats, sharp: Floats
) -> tuple[Floats, float, float]:
    """The parameters at the nearest least chi² (Levenberg-Marquardt), it, and the variance of the place."""
    chi2, gradient, normal = _equations(p, t, weight, frequency, down, sharp)
    damping = 1e-3
    for _ in range(_STEPS):
        system = normal.copy()
        for i in range(5):
            system[i, i] += damping * normal[i, i] + 1e-12
        system[2, 2] += 1e-6  # a spread has no say where there is next to no second path
        trial = p + np.linalg.solve(system, gradient)
        trial[2] = min(max(trial[2], _NARROWEST), _BROADEST)
        trial[3], trial[4] = max(trial[3], 1e-6), max(trial[4], 0.0)
        outcome, next_gradient, next_normal = _equations(trial, t, weight, frequency, down, sharp)
        if outcome < chi2:
            gain = chi2 - outcome
            p, chi2, gradient, normal = trial, outcome, next_gradient, next_normal
            damping *= 0.3
            if gain < 1e-2:
                break
        else:
            damping *= 6.0
            if damping > 1e6:
                break
    known = normal.copy()
    known[2, 2] += 1.0 / _BREADTH_SIGMA**2
    for i in range(5):
        known[i, i] += 1e-9 * known[i, i] + 1e-12
    return p, chi2, np.linalg.inv(known)[0, 0]


def _both(t: Complexes, weight: Floats, slope: Floats, f: Floats, g: Floats) -> Floats:
    """(N, 7) of pixels' phasors (N, K), turned back to one path's column: see _Paths."""
    usual = f + g * float(np.median(slope))  # near enough to begin with
    nodes = np.array([(side * far, b) for far in _APART for b in _BREADTHS for side in (-1.0, 1.0)])
    spreads = np.stack([_spread(usual, g, *node) for node in nodes])
    turns = np.exp(-1j * usual * _PLACES[:, None])
    return np.asarray(_fits(t, weight, slope, f, g, turns, nodes, spreads))


@njit(cache=True, parallel=True, nogil=True)
def _fits(
    t: Complexes,
    weight: Floats,
    slope: Floats,
    f: Floats,
    g: Floats,
    turns: Complexes,
    nodes: Floats,
    spreads: Complexes,
) -> Floats:
    found = np.full((len(t), 7), np.nan)
    q = f * f + g * g
    sharp = np.exp(-FOOTPRINT_PX2 * q)
    for n in prange(len(t)):
        frequency = f + g * slope[n]
        gains, others = _starts(t[n], weight[n], sharp, turns, nodes, spreads)
        fits = np.full((_TRIED, 5), np.inf)  # chi², place, distance, share, variance
        for k in range(_TRIED):
            at = np.argmax(gains)
            if not gains[at] > 0.0:
                break
            start = np.array((_PLACES[at], others[at, 0], others[at, 1], others[at, 2], others[at, 3]))
            p, chi2, variance = _fitted(start, t[n], weight[n], frequency, g, sharp)
            fits[k] = np.array((chi2, p[0], p[1], p[4] / p[3], variance))
            gains[np.abs(_PLACES - _PLACES[at]) < _DISTINCT_PX] = -1.0
        best = np.argmin(fits[:, 0])
        if not np.isfinite(fits[best, 0]):
            continue
        others_chi2 = fits[np.abs(fits[:, 1] - fits[best, 1]) > _DISTINCT_PX - 0.5, 0]
        second = others_chi2.min() if len(others_chi2) else np.inf
        chi2, place, apart, share, variance = fits[best]
        one = _one_path(t[n], weight[n], q)
        found[n] = np.array((place, np.sqrt(max(variance, 0.0)), one, chi2, second, apart, share))
    return found
