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
"""Of the weaker path's light over the stronger's. Less of another moves no column by more than noise, and a
wrong fit needs less direct light: of 172 such pixels on 30 rendered wheels 171 were over a pixel off."""
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
"""Places and sides from which the fit starts, the best first."""
_DISTINCT_PX = 1.5
"""Between them; and, less half a pixel, between fits that are different answers."""
_FAINTEST = 1e-6
"""Amplitude of a direct path that is none: above zero, for shares are over it."""
_SETTLED = 1e-2
"""Of the misfit: a step that gains less in chi² is the last one."""
_STEPS = 25
"""Bounds Levenberg-Marquardt, which ends by itself: 240 fits in five steps in the median, in 23 at most."""


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
    · frequencies), a twentieth of a millisecond each.

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
        told = (paths.one > _BETTER * paths.both) & (lead > _LEAST_LEAD)
        told &= (paths.share > _LEAST_SHARE) & (paths.share < 1.0 / _LEAST_SHARE)
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
def _log_of(frequency: float, apart: float, breadth: float) -> complex:
    """Logarithm of 1 - i F D b²; see :func:`direct_of_two`."""
    size = frequency * apart * breadth**2
    return complex(0.5 * np.log(1.0 + size * size), -np.arctan(size))


@njit(cache=True, nogil=True)
def _spread(log: complex, down: float, breadth: float) -> complex:
    """Phasor of interreflected light of one unit, from the direct column."""
    return complex(np.exp(-log / breadth**2 - 0.5 * _ROWS_PX2 * down * down))


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
    """(3, P) best gain in chi² at each place of the direct path; (3, P, 2) the other's distance and breadth.

    Others near by, to the left and to the right stand apart: one near by makes up for a place between those
    that are tried, and would hide the one that is there.
    """
    places = turns.shape[1]
    turned, match, to = np.empty((2, len(t), places)), np.zeros(places), np.empty(places)
    gains, others = np.full((3, places), -1.0), np.zeros((3, places, 2))
    ss = 0.0
    for k in range(len(t)):
        ss += weight[k] * sharp[k] ** 2
        one = weight[k] * t[k]
        for a in range(places):
            turned[0, k, a] = one.real * turns[k, a].real - one.imag * turns[k, a].imag
            turned[1, k, a] = one.real * turns[k, a].imag + one.imag * turns[k, a].real
            match[a] += sharp[k] * turned[0, k, a]
    for n in range(len(nodes)):
        oo, so = 0.0, 0.0
        to[:] = 0.0
        for k in range(len(t)):
            real, imag = spreads[n, k].real, spreads[n, k].imag
            oo += weight[k] * (real * real + imag * imag)
            so += weight[k] * sharp[k] * real
            for a in range(places):  # innermost, for it runs through memory
                to[a] += turned[0, k, a] * real + turned[1, k, a] * imag
        kind = 0 if abs(nodes[n, 0]) < _NEAR_PX else (1 if nodes[n, 0] < 0.0 else 2)
        det = ss * oo - so * so
        if not det > 1e-6 * ss * oo:
            continue
        for a in range(places):
            direct, second = (oo * match[a] - so * to[a]) / det, (ss * to[a] - so * match[a]) / det
            gain = direct * match[a] + second * to[a] - (nodes[n, 0] / _FAR_PX) ** 2
            if direct > 0.0 and second > 0.0 and gain > gains[kind, a]:
                gains[kind, a] = gain
                others[kind, a] = nodes[n]
    return gains, others


@njit(cache=True, nogil=True)
def _amplitudes(t: Complexes, weight: Floats, direct: Complexes, other: Complexes) -> tuple[float, float]:
    """Those of both paths that fit best, none below zero."""
    dd, do, oo, td, to = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(len(t)):
        d, o, w = direct[k], other[k], weight[k]
        dd += w * (d.real * d.real + d.imag * d.imag)
        oo += w * (o.real * o.real + o.imag * o.imag)
        do += w * (d.real * o.real + d.imag * o.imag)
        td += w * (t[k].real * d.real + t[k].imag * d.imag)
        to += w * (t[k].real * o.real + t[k].imag * o.imag)
    det = dd * oo - do * do
    one, two = td / dd, 0.0
    if det > 1e-9 * dd * oo:
        one, two = (oo * td - do * to) / det, (dd * to - do * td) / det
        if two < 0.0:
            one, two = td / dd, 0.0
        elif one < 0.0:
            one, two = 0.0, to / oo
    return max(one, _FAINTEST), max(two, 0.0)


@njit(cache=True, nogil=True)
def _equations(
    p: Floats, t: Complexes, weight: Floats, frequency: Floats, down: Floats, sharp: Floats
) -> tuple[float, Floats, Floats]:
    """Chi², its gradient and normal matrix, of place, distance, breadth and both amplitudes.

    The amplitudes put into ``p`` are those that fit best there (variable projection: Golub, Pereyra 1973).
    """
    place, apart, breadth = p[0], p[1], p[2]
    square = breadth * breadth
    direct, other, logs = np.empty((3, len(t)), np.complex128)
    for k in range(len(t)):
        at = frequency[k] * place
        turn = complex(np.cos(at), np.sin(at))
        logs[k] = _log_of(frequency[k], apart, breadth)
        direct[k], other[k] = sharp[k] * turn, turn * _spread(logs[k], down[k], breadth)
    p[3], p[4] = _amplitudes(t, weight, direct, other)
    J, gradient, normal = np.empty(5, np.complex128), np.zeros(5), np.zeros((5, 5))
    chi2 = (apart / _FAR_PX) ** 2
    for k in range(len(t)):
        J[3], J[4] = direct[k], other[k]
        model = p[3] * J[3] + p[4] * J[4]
        per_apart = 1j * frequency[k] / complex(1.0, -frequency[k] * apart * square)
        J[0] = 1j * frequency[k] * model
        J[1] = p[4] * J[4] * per_apart
        J[2] = p[4] * J[4] * (2.0 / (breadth * square) * logs[k] + 2.0 * apart / breadth * per_apart)
        off = t[k] - model
        chi2 += weight[k] * (off.real * off.real + off.imag * off.imag)
        for i in range(5):
            real, imag = weight[k] * J[i].real, weight[k] * J[i].imag
            gradient[i] += real * off.real + imag * off.imag
            for j in range(i + 1):
                normal[i, j] += real * J[j].real + imag * J[j].imag
    for i in range(5):
        for j in range(i):
            normal[j, i] = normal[i, j]
    gradient[1] -= apart / _FAR_PX**2
    normal[1, 1] += 1.0 / _FAR_PX**2
    return chi2, gradient, normal


@njit(cache=True, nogil=True)
def _fitted(
    p: Floats, t: Complexes, weight: Floats, frequency: Floats, down: Floats, sharp: Floats
) -> tuple[Floats, float, float]:
    """The parameters at the nearest least chi² (Levenberg-Marquardt), it, and the variance of the place."""
    least = np.array((-np.inf, -np.inf, _NARROWEST, _FAINTEST, 0.0))
    most = np.array((np.inf, np.inf, _BROADEST, np.inf, np.inf))
    chi2, gradient, normal = _equations(p, t, weight, frequency, down, sharp)
    damping, settled = 1e-1, _SETTLED * max(chi2 / (2.0 * len(t)), 1.0)
    for _ in range(_STEPS):
        system = normal.copy()
        for i in range(3):  # the amplitudes follow by themselves
            system[i, i] += damping * normal[i, i] + 1e-12
        system[2, 2] += 1e-6  # a spread has no say where there is next to no second path
        for i in range(2, 5):
            if (p[i] <= least[i] and gradient[i] < 0.0) or (p[i] >= most[i] and gradient[i] > 0.0):
                system[i, :], system[:, i] = 0.0, 0.0  # it stays at its bound
                system[i, i], gradient[i] = 1.0, 0.0
            system[i, i] += 1e-12
        trial = p + np.linalg.solve(system, gradient)
        trial[2] = min(max(trial[2], least[2]), most[2])
        outcome, next_gradient, next_normal = _equations(trial, t, weight, frequency, down, sharp)
        if outcome < chi2:
            gain = chi2 - outcome
            p, chi2, gradient, normal = trial, outcome, next_gradient, next_normal
            damping *= 0.3
            if gain < settled:
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
    spreads = np.array(
        [
            [_spread(_log_of(one, *node), down, node[1]) for one, down in zip(usual, g, strict=True)]
            for node in nodes
        ]
    )
    turns = np.exp(-1j * usual[:, None] * _PLACES)
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
            kind, at = divmod(np.argmax(gains), len(_PLACES))
            if not gains[kind, at] > 0.0:
                break
            start = np.array((_PLACES[at], others[kind, at, 0], others[kind, at, 1], 0.0, 0.0))
            p, chi2, variance = _fitted(start, t[n], weight[n], frequency, g, sharp)
            fits[k] = np.array((chi2, p[0], p[1], p[4] / p[3], variance))
            gains[kind][np.abs(_PLACES - _PLACES[at]) < _DISTINCT_PX] = -1.0
        best = np.argmin(fits[:, 0])
        if not np.isfinite(fits[best, 0]):
            continue
        others_chi2 = fits[np.abs(fits[:, 1] - fits[best, 1]) > _DISTINCT_PX - 0.5, 0]
        second = others_chi2.min() if len(others_chi2) else np.inf
        chi2, place, apart, share, variance = fits[best]
        one = _one_path(t[n], weight[n], q)
        found[n] = np.array((place, np.sqrt(max(variance, 0.0)), one, chi2, second, apart, share))
    return found
