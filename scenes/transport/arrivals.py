"""From the samples of each camera pixel to rows of the matrix, and what they say of their own error."""

from __future__ import annotations

from typing import Any, NamedTuple

import numba as nb
import numpy as np
from numpy.typing import NDArray

from burrscan.arrays import Floats, Floats32, Ints, Ints32
from scenes.transport.paths import Bounced
from scenes.transport.rows import SparseRows

Pixels = NDArray[np.uint32]
_LEARNT_TURNS = 2
"""A fourth surface adds nothing that could be seen: the turn towards it is not learnt."""

REPLICATES = 4
"""Independent scramblings of a refined pixel: their scatter is its error (Owen 1997; 4 cost the accuracy of
half the samples at most and leave three degrees of freedom)."""


class Finds(NamedTuple):
    """Paths that carry light, by camera pixel.

    ``light``: of each, a row per flat pixel; its columns number the rows of ``points_mm`` (n, 3), the surface
    that each met after the turn in question, camera frame.
    """

    light: SparseRows
    points_mm: Floats32


class Gathered(NamedTuple):
    """Rows of some pixels, in their order.

    ``rows``: the light of each projector pixel. ``variance`` (P,): of one sample's light. ``scatter`` (P,):
    variance of the mean of the replicates' means. ``finds``: for the first two turns, the paths that carry
    light.
    """

    rows: SparseRows
    variance: Floats
    scatter: Floats
    finds: tuple[Finds, ...]


def gather(bounced: Bounced, *, samples: int, paths: int) -> Gathered:
    """Rows of pixels whose samples stand one after the other.

    Parameters
    ----------
    bounced
        What each of P · samples paths brings.
    samples
        Per pixel; consecutive quarters of them (of fewer than four, each) are the replicates.
    paths
        How many there are.

    Returns
    -------
    An entry for each sample and bounce with light, its value the light over ``samples``. O(paths).

    """
    pixel = np.zeros((len(bounced.arrivals), paths), np.uint32)
    weight = np.zeros((len(bounced.arrivals), paths), np.float32)
    for bounce, arrival in enumerate(bounced.arrivals):
        pixel[bounce], weight[bounce] = arrival.pixel.numpy(), arrival.weight.numpy()
    starts = np.zeros(paths // samples + 1, np.int64)
    np.cumsum(_count(weight, samples), out=starts[1:])
    columns, values, variance, scatter = _fill(pixel, weight, samples, starts)
    finds = [
        _finds(place, weight[turn:].sum(axis=0), samples)
        for turn, place in enumerate(bounced.places_mm[:_LEARNT_TURNS])
    ]
    return Gathered(SparseRows(starts, columns, values), variance, scatter, tuple(finds))


def _finds(place: Any, light: Floats32, samples: int) -> Finds:
    lit = np.flatnonzero(light)
    starts = np.searchsorted(lit, np.arange(light.size // samples + 1) * samples)
    rows = SparseRows(starts, np.arange(lit.size, dtype=np.int32), light[lit])
    return Finds(rows, np.ascontiguousarray(place.numpy().T[lit]))


@nb.njit(cache=True, parallel=True)
def _count(weight: Floats32, samples: int) -> Ints:
    bounces, total = weight.shape
    counts = np.zeros(total // samples, np.int64)
    for p in nb.prange(counts.size):
        for s in range(p * samples, (p + 1) * samples):
            for b in range(bounces):
                counts[p] += weight[b, s] > 0.0
    return counts


@nb.njit(cache=True, parallel=True)
def _fill(
    pixel: Pixels, weight: Floats32, samples: int, starts: Ints
) -> tuple[Ints32, Floats32, Floats, Floats]:
    count = starts.size - 1
    columns, values = np.empty(starts[-1], np.int32), np.empty(starts[-1], np.float32)
    variance, scatter = np.zeros(count), np.zeros(count)
    replicates = min(REPLICATES, samples)
    part = samples // replicates
    for p in nb.prange(count):
        k = starts[p]
        total, square, spread = 0.0, 0.0, 0.0
        for r in range(replicates):
            mean = 0.0
            for s in range(p * samples + r * part, p * samples + (r + 1) * part):
                light, k = _put(pixel[:, s], weight[:, s], samples, k, columns, values)
                mean += light / part
                square += light * light
            total += mean
            spread += mean * mean
        mean = total / replicates
        variance[p] = max(square / samples - mean * mean, 0.0) * samples / (samples - 1)
        scatter[p] = max(spread / replicates - mean * mean, 0.0) / (replicates - 1)
    return columns, values, variance, scatter


@nb.njit(cache=True)
def _put(
    pixel: Pixels, weight: Floats32, samples: int, k: int, columns: Ints32, values: Floats32
) -> tuple[float, int]:
    """Enter one sample's bounces from entry ``k`` on; its light, and the next free entry."""
    light = 0.0
    for b in range(weight.size):
        if weight[b] > 0.0:
            columns[k] = pixel[b]
            values[k] = weight[b] / samples
            light += weight[b]
            k += 1
    return light, k
