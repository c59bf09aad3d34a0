"""Micro phase shifting: upright sine stripes of several close, fine periods.

All patterns have nearly one high frequency, so neither defocus nor interreflected light treats them
differently, and the column follows from the phases together (Gupta & Nayar 2012). Here every period has three
steps of its own, and the columns are compared by least squares of the phasors.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numba import njit, prange

from burrscan.arrays import Floats, Floats32, Image
from burrscan.codes.code import Code
from burrscan.codes.rivals.multifrequency import encode, phases_of
from burrscan.correspondence import Correspondence
from burrscan.devices import CameraSheet

_MAIN_LOBE_PX = 6.0
"""Half-width of the sum's peak: half of the finest period of 12 px; what is farther is another candidate."""
_GRID_PX = 2.0
"""Step of the search: a sixth of the finest period, so that a step lies well inside the right peak."""


def periods_px(*, width: int, count: int, finest_px: float, coarsest_px: float) -> tuple[float, ...]:
    """``count`` periods whose stripes come into step at no other column, the best of seeded spreads."""
    rng = np.random.default_rng(count)
    edges = np.linspace(0.0, 1.0, count + 1)[:-1]
    spreads = edges + rng.uniform(0.0, 1.0 / count, (256, count))
    frequencies = 1.0 / coarsest_px + (1.0 / finest_px - 1.0 / coarsest_px) * spreads
    apart = np.arange(_MAIN_LOBE_PX, width, 0.5)
    lobes = [np.cos(2.0 * np.pi * apart[:, None] * one).mean(axis=1).max() for one in frequencies]
    return tuple(float(1.0 / f) for f in frequencies[int(np.argmin(lobes))])


def decode(
    images: Image,
    camera: CameraSheet,
    *,
    width: int,
    periods: tuple[float, ...],
    max_sigma_px: float,
    least_lead: float = 16.0,
) -> Correspondence:
    """The column whose predicted phases fit best; masked where the second best fits nearly as well."""
    phases = phases_of(images, camera, periods_px=periods, steps=3)
    u_px, sigma, lead = _best(
        np.stack([p.offset_px for p in phases]),
        np.stack([p.sigma_px for p in phases]),
        np.stack([p.amplitude_dn for p in phases]),
        2.0 * np.pi / np.array(periods),
        width,
    )
    clipped = np.logical_or.reduce([p.clipped for p in phases])
    with np.errstate(invalid="ignore"):
        mask = (sigma <= max_sigma_px) & (lead >= least_lead) & ~clipped
    nan = np.float32(np.nan)
    return Correspondence(np.where(mask, u_px, nan), np.where(mask, sigma, nan), mask)


@njit(cache=True, nogil=True)
def _highest(re: Floats, im: Floats, table: Floats, sums: Floats) -> tuple[int, float]:
    """Place on the grid of the highest sum of the phasors, and the highest beyond its main lobe."""
    at = 0
    for i in range(len(sums)):
        sums[i] = 0.0
        for j in range(len(re)):
            sums[i] += re[j] * table[i, j, 0] + im[j] * table[i, j, 1]
        if sums[i] > sums[at]:
            at = i
    second = 0.0
    for i in range(len(sums)):
        if abs(i - at) * _GRID_PX > _MAIN_LOBE_PX:
            second = max(second, sums[i])
    return at, second


@njit(cache=True, nogil=True)
def _refined(re: Floats, im: Floats, k: Floats, f: Floats, u: float) -> tuple[float, float, float, float]:
    """The column by three Newton steps, the sum of the phasors there, its information, the weights' sum."""
    along, information, total = 0.0, 0.0, 0.0
    for _ in range(3):
        information, moment, along, total = 0.0, 0.0, 0.0, 0.0
        for j in range(len(re)):
            c0, s0 = np.cos(f[j] * u), np.sin(f[j] * u)
            along += re[j] * c0 + im[j] * s0
            moment += f[j] * (im[j] * c0 - re[j] * s0)
            information += k[j] * f[j] * f[j]
            total += k[j]
        u += moment / (information * along / total)
    return u, along, information, total


@njit(cache=True, parallel=True, nogil=True)
def _best(
    offset: Floats32, sigma: Floats32, amplitude: Floats32, f: Floats, columns: int
) -> tuple[Floats32, Floats32, Floats32]:
    count, height, width = offset.shape
    u_px = np.full((height, width), np.nan, np.float32)
    stated = np.full((height, width), np.nan, np.float32)
    lead = np.zeros((height, width), np.float32)
    places = int(columns / _GRID_PX) + 1
    table = np.empty((places, count, 2))
    for i in range(places):
        for j in range(count):
            table[i, j, 0], table[i, j, 1] = np.cos(i * _GRID_PX * f[j]), np.sin(i * _GRID_PX * f[j])
    for r in prange(height):
        re, im, k = np.empty(count), np.empty(count), np.empty(count)
        sums = np.empty(places)
        for c in range(width):
            power = 0.0
            for j in range(count):
                # weights make the sum a likelihood: relative error of a phasor is its phase's, in radians
                k[j] = (
                    1.0 / (sigma[j, r, c] * f[j] * amplitude[j, r, c]) ** 2
                    if amplitude[j, r, c] > 0.0
                    else 0.0
                )
                re[j] = k[j] * amplitude[j, r, c] * np.cos(offset[j, r, c] * f[j])
                im[j] = k[j] * amplitude[j, r, c] * np.sin(offset[j, r, c] * f[j])
                power += k[j] * amplitude[j, r, c] ** 2
            if not power > 4.0 * count:
                continue
            at, second = _highest(re, im, table, sums)
            u, along, information, total = _refined(re, im, k, f, at * _GRID_PX)
            if along > 0.0 and -0.5 < u < columns - 0.5:
                u_px[r, c] = u
                stated[r, c] = total / (along * np.sqrt(information))
                lead[r, c] = (along * along - second * second) / total
    return u_px, stated, lead


def micro_phase(
    *,
    width: int,
    count: int = 8,
    finest_px: float = 12.0,
    coarsest_px: float = 20.0,
    max_sigma_px: float = 0.4,
) -> Code:
    """``count`` periods between ``finest_px`` and ``coarsest_px``, three steps each."""
    periods = periods_px(width=width, count=count, finest_px=finest_px, coarsest_px=coarsest_px)
    light, names = encode(width=width, periods_px=periods, steps=3)
    return Code(light, names, partial(decode, width=width, periods=periods, max_sigma_px=max_sigma_px))
