"""Reading stripes from one picture: sure places first, then their neighbours, by least squares on windows.

Reliability-guided digital image correlation (Pan 2009) against the known light: a window of the picture is
``gain · light(u + p dx + q dy + k dx² / 2) + offset + tilt dx``; the last two are interreflected light. On a
coarse grid the whole raster is searched for ``u``; a place that is sure starts a wave, in which every pixel
takes over from its best neighbour and is refined.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit, prange

from burrscan.arrays import Bools, Floats, Floats32, Ints16

_GRID_PX = 12
"""Between the places that are searched over the whole raster; waves reach the rest. The cost falls with its
square."""
_SEED_REACH, _SEED_ROWS = 20, 0
"""Half of a search's window, px: one row of 41, some ten stripes, twice the five that identify a place."""
_REACH, _ROWS = 10, 2
"""Half of the window of 21 × 5 px that a column rests on: seven unknowns from 105 pixels."""
_SLOPES = 15
"""Tried between the steepest either way, 12 % apart: half a step over the five stripes of half a window is
a third of one."""
_STEEPEST = 2.2
"""Ratio to the frontal slope to either side; beyond it, stripes are too narrow or too wide to be told."""
_SURE_FIT, _SURE_LEAD = 0.75, 0.1
"""Correlation of a sure place, and how far it leads any other: an error here spreads with the wave."""
_LEAST_INSIDE = 0.8
"""Share of the window's weight that must fall on the raster: a part of it matches by chance more easily."""
_LEAST_FIT = 0.9
"""Correlation of a refined window: lower, it holds an edge, another surface or a wrong stripe."""
_TURNS = 4
"""Gauss-Newton steps: a neighbour's start is within a fraction of a stripe."""
_WAVES = 200
"""Bounds the growth, one pixel each to all sides: seeds are 12 px apart, long ways round holes included."""


class Shot(NamedTuple):
    """What a picture tells; all (h, w), NaN where nothing is known.

    ``u_px`` and ``sigma_px``: column and its standard deviation. ``slope``, ``shear``: its change per camera
    column and row; ``bend``: the slope's change per camera column. ``fit``: share of the window's weighted
    variance that the light explains.
    """

    u_px: Floats32
    sigma_px: Floats32
    slope: Floats32
    shear: Floats32
    bend: Floats32
    fit: Floats32


def read_shot(
    seen: Floats32, weight: Floats32, light: Floats, *, magnification: float, stripe_px: float
) -> Shot:
    """Columns from one picture.

    Parameters
    ----------
    seen
        (h, w) light relative to what full white gives each pixel.
    weight
        (h, w) inverse variance of it, 0 where nothing is seen or the pixel is clipped.
    light
        (W,) light of each projector column.
    magnification
        Projector columns per camera column on a surface that faces both.
    stripe_px
        Columns per stripe.

    Notes
    -----
    O(h·w·window + h·w / grid² · W · slopes · window).

    """
    slopes = magnification * np.geomspace(1.0 / _STEEPEST, _STEEPEST, _SLOPES)
    state = _seeds(seen, weight, light, slopes, 1.5 * stripe_px)
    tried = np.zeros(seen.shape, np.int16)
    for _ in range(_WAVES):
        state, grown = _wave(state, seen, weight, light, tried)
        if not grown:
            break
    return Shot(*state)


@njit(cache=True, nogil=True, inline="always")
def _light(light: Floats, u: float) -> float:
    low = min(max(math.floor(u), 0), len(light) - 2)
    return float(light[low] + (u - low) * (light[low + 1] - light[low]))


@njit(cache=True, parallel=True, nogil=True)
def _seeds(seen: Floats32, weight: Floats32, light: Floats, slopes: Floats, apart_px: float) -> Floats32:
    height, width = seen.shape
    state = np.full((6, height, width), np.nan, np.float32)
    for i in prange(height // _GRID_PX):
        r = np.int64(i) * _GRID_PX + _GRID_PX // 2  # signed: the kernels are compiled for one kind of row
        found, start, scores = np.empty(6), np.empty(4), np.empty(len(light))
        for c in range(_GRID_PX // 2, width, _GRID_PX):
            if (
                weight[r, c] > 0.0
                and _search(seen, weight, light, slopes, r, c, apart_px, scores, start)
                and _refine(seen, weight, light, r, c, start, found)
                and found[5] >= _LEAST_FIT
                and abs(found[0] - start[0]) < apart_px
            ):
                for k in range(6):
                    state[k, r, c] = found[k]
    return state


@njit(cache=True, nogil=True)
def _search(
    seen: Floats32,
    weight: Floats32,
    light: Floats,
    slopes: Floats,
    r: int,
    c: int,
    apart_px: float,
    scores: Floats,
    start: Floats,
) -> bool:
    """The column and slope that correlate best, if they lead clearly over any other column."""
    scores.fill(0.0)
    best = 0.0
    for slope in slopes:
        for u in range(len(light)):
            score = _correlation(seen, weight, light, r, c, float(u), slope)
            scores[u] = max(scores[u], score)
            if score > best:
                best = score
                start[0], start[1], start[2], start[3] = u, slope, 0.0, 0.0
    second = 0.0
    for u in range(len(light)):
        if abs(u - start[0]) > 2.0 * apart_px:
            second = max(second, scores[u])
    return best >= _SURE_FIT and best - second >= _SURE_LEAD


@njit(cache=True, nogil=True)
def _correlation(
    seen: Floats32, weight: Floats32, light: Floats, r: int, c: int, u: float, slope: float
) -> float:
    """Weighted correlation of a window with the light around a column; 0 where it leaves the raster."""
    height, width = seen.shape
    whole, n, a, b, aa, bb, ab = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for y in range(max(r - _SEED_ROWS, 0), min(r + _SEED_ROWS + 1, height)):
        for x in range(max(c - _SEED_REACH, 0), min(c + _SEED_REACH + 1, width)):
            w = float(weight[y, x])
            whole += w
            at = u + slope * (x - c)
            if w > 0.0 and 0.0 <= at <= len(light) - 1.0:
                f, g = float(seen[y, x]), _light(light, at)
                n, a, b = n + w, a + w * f, b + w * g
                aa, bb, ab = aa + w * f * f, bb + w * g * g, ab + w * f * g
    if n <= _LEAST_INSIDE * whole:
        return 0.0
    va, vb = aa - a * a / n, bb - b * b / n
    return (ab - a * b / n) / math.sqrt(va * vb) if va > 0.0 and vb > 0.0 else 0.0


@njit(cache=True, parallel=True, nogil=True)
def _wave(
    state: Floats32, seen: Floats32, weight: Floats32, light: Floats, tried: Ints16
) -> tuple[Floats32, int]:
    """Every unknown pixel beside a known one takes over from the best such neighbour, and is refined.

    ``tried`` (h, w): from which of its neighbours a pixel took over in vain; it does not try that again.
    """
    height, width = seen.shape
    after = state.copy()
    grown = np.zeros(height, np.int64)
    for r in prange(height):
        found, start = np.empty(6), np.empty(4)
        for c in range(width):
            if weight[r, c] <= 0.0 or not np.isnan(state[0, r, c]):
                continue
            best = _take_over(state, np.int64(r), c, start)
            if best == tried[r, c]:  # or none
                continue
            tried[r, c] = best
            fitted = _refine(seen, weight, light, np.int64(r), c, start, found)
            if fitted and found[5] >= _LEAST_FIT and abs(found[0] - start[0]) < 1.0:
                for k in range(6):
                    after[k, r, c] = found[k]
                grown[r] += 1
    return after, grown.sum()


@njit(cache=True, nogil=True)
def _take_over(state: Floats32, r: int, c: int, start: Floats) -> int:
    """Which of a pixel's four neighbours fits best, from 1; 0 where none is known."""
    best, which = 0.0, 0
    for number, (dy, dx) in enumerate(((0, -1), (0, 1), (-1, 0), (1, 0))):
        y, x = r + dy, c + dx
        if 0 <= y < state.shape[1] and 0 <= x < state.shape[2] and state[5, y, x] > best:
            best, which = state[5, y, x], number + 1
            bend = state[4, y, x]
            start[1], start[2], start[3] = state[2, y, x] - bend * dx, state[3, y, x], bend
            start[0] = state[0, y, x] - start[1] * dx - start[2] * dy - 0.5 * bend * dx * dx
    return which


@njit(cache=True, nogil=True)
def _refine(
    seen: Floats32, weight: Floats32, light: Floats, r: int, c: int, start: Floats, found: Floats
) -> bool:
    """Gauss-Newton on column, slope, shear, bend, gain, offset and tilt of one window; False where it fails.

    ``found`` becomes column, sigma, slope, shear, bend and fit. Sigma is that of the noise, or that of the
    residuals, camera column by camera column, if it is larger: what the model leaves over is alike in all
    rows of a column (clustered sandwich estimator, Liang and Zeger 1986).
    """
    if not _both_sides(weight, r, c):
        return False
    u, p, q, bend = start
    gain, offset, tilt = 1.0, 0.0, 0.0
    normal, scaled, moment, step = np.empty((7, 7)), np.empty((7, 7)), np.empty(7), np.empty(7)
    inverse: Any = normal
    first, end = max(c - _REACH, 0), min(c + _REACH + 1, seen.shape[1])
    chi2, total, count = 0.0, 0.0, 0
    for turn in range(_TURNS + 1):
        normal.fill(0.0)
        moment.fill(0.0)
        chi2, total, count = _sums(
            seen, weight, light, r, c, first, end, (u, p, q, bend, gain, offset, tilt), normal, moment
        )
        if count < 30 or not _posed(normal, scaled):
            return False
        inverse = np.linalg.inv(normal)
        if turn < _TURNS:
            for k in range(7):
                step[k] = _dot(inverse[k], moment)
            if not abs(step[0]) < 4.0:
                return False
            u, p, q, bend = u + step[0], p + step[1], q + step[2], bend + step[3]
            gain, offset, tilt = gain + step[4], offset + step[5], tilt + step[6]
    left = _left_over(seen, weight, light, r, c, (u, p, q, bend, gain, offset, tilt), inverse[0])
    found[0], found[2], found[3], found[4] = u, p, q, bend
    found[1] = math.sqrt(max(inverse[0, 0], left))
    found[5] = 1.0 - chi2 / total if gain > 0.0 and total > 0.0 else 0.0
    return bool(p > 0.0 and 0.0 <= u <= len(light) - 1.0)


@njit(cache=True, nogil=True)
def _posed(normal: Floats, scaled: Floats) -> bool:
    """Whether the window determines all unknowns; ``scaled`` is room for the matrix without units."""
    for k in range(7):
        if normal[k, k] <= 0.0:
            return False
        normal[k, k] *= 1.0 + 1e-9
    for k in range(7):
        for j in range(7):
            scaled[k, j] = normal[k, j] / math.sqrt(normal[k, k] * normal[j, j])
    return bool(np.linalg.cond(scaled) <= 1e6)


@njit(cache=True, nogil=True)
def _dot(one: Floats, other: Floats) -> float:
    total = 0.0
    for k in range(len(one)):
        total += one[k] * other[k]
    return total


@njit(cache=True, nogil=True)
def _both_sides(weight: Floats32, r: int, c: int) -> bool:
    """Whether the outer half of the window sees something on the left and on the right.

    At a limb or a shadow's border the window would have to extrapolate.
    """
    left, right = False, False
    for x in range(_REACH // 2, _REACH + 1):
        left |= c - x >= 0 and weight[r, c - x] > 0.0
        right |= c + x < weight.shape[1] and weight[r, c + x] > 0.0
    return left and right


@njit(cache=True, nogil=True)
def _left_over(
    seen: Floats32,
    weight: Floats32,
    light: Floats,
    r: int,
    c: int,
    at: tuple[float, float, float, float, float, float, float],
    pull: Floats,
) -> float:
    """Variance of the column by the residuals: each camera column's whole pull on it, squared and summed."""
    normal, moment = np.zeros((7, 7)), np.empty(7)
    variance, columns = 0.0, 0
    for x in range(max(c - _REACH, 0), min(c + _REACH + 1, seen.shape[1])):
        moment.fill(0.0)
        _, _, count = _sums(seen, weight, light, r, c, x, x + 1, at, normal, moment)
        if count:
            variance += _dot(pull, moment) ** 2
            columns += 1
    return variance * columns / max(columns - 7, 1)


@njit(cache=True, nogil=True)
def _add_equation(w: float, row: Floats, left: float, normal: Floats, moment: Floats) -> None:
    """Add a pixel's equation, of weight ``w``, to the normal equations."""
    for k in range(7):
        moment[k] += w * row[k] * left
        for j in range(7):
            normal[k, j] += w * row[k] * row[j]


@njit(cache=True, nogil=True)
def _sums(
    seen: Floats32,
    weight: Floats32,
    light: Floats,
    r: int,
    c: int,
    first: int,
    end: int,
    at: tuple[float, float, float, float, float, float, float],
    normal: Floats,
    moment: Floats,
) -> tuple[float, float, int]:
    """Normal equations of a window's columns ``first`` up to ``end``; chi², the weighted variance, pixels."""
    height = seen.shape[0]
    u, p, q, bend, gain, offset, tilt = at
    chi2, n, f1, f2, count = 0.0, 0.0, 0.0, 0.0, 0
    row = np.empty(7)
    for y in range(max(r - _ROWS, 0), min(r + _ROWS + 1, height)):
        for x in range(first, end):
            w = float(weight[y, x])
            dx, dy = float(x - c), float(y - r)
            place = u + p * dx + q * dy + 0.5 * bend * dx * dx
            if w <= 0.0 or place < 1.0 or place > len(light) - 2.0:
                continue
            g, value = _light(light, place), float(seen[y, x])
            slope = 0.5 * gain * (_light(light, place + 1.0) - _light(light, place - 1.0))
            row[0], row[1], row[2], row[3] = slope, slope * dx, slope * dy, 0.5 * slope * dx * dx
            row[4], row[5], row[6] = g, 1.0, dx
            left = value - gain * g - offset - tilt * dx
            _add_equation(w, row, left, normal, moment)
            chi2, n, f1, f2, count = (
                chi2 + w * left * left,
                n + w,
                f1 + w * value,
                f2 + w * value**2,
                count + 1,
            )
    return chi2, f2 - f1 * f1 / n if n > 0.0 else 0.0, count


def accepted(shot: Shot, *, width: int, max_sigma_px: float) -> Bools:
    """Pixels that are known, fine enough, and on the raster."""
    with np.errstate(invalid="ignore"):
        return np.asarray((shot.sigma_px <= max_sigma_px) & (shot.u_px > -0.5) & (shot.u_px < width - 0.5))
