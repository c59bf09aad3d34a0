"""From the samples of each camera pixel to rows of the matrix, and what they say of their own error."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numba as nb
import numpy as np
from numpy.typing import NDArray

from burrscan.arrays import Floats, Floats32, Ints
from scenes.transport.paths import Arrival
from scenes.transport.rows import SparseRows

_NONE = np.zeros(0, np.uint32)
"""Of no paths."""
_LEARNT_TURNS = 2
"""A fourth surface adds nothing that could be seen: the turn towards it is not learnt."""

REPLICATES = 2
"""Least independent scramblings of a refined pixel: their scatter is its error (Owen 1997). Two nets instead
of four of half the size make errors smaller by a tenth. Their one degree of freedom is enough, for what a net
gains is pooled over the neighbours (:mod:`scenes.transport.uncertainty`)."""


class Finds(NamedTuple):
    """Paths that carry light, by camera pixel.

    ``light``: of each, a row per flat pixel; its columns number the rows of ``directions`` (n, 3), unit
    vectors in which each went at the turn in question, camera frame.
    """

    light: SparseRows
    directions: Floats32


class Gathered(NamedTuple):
    """Rows of some pixels, in their order.

    ``samples`` (P,): paths of each. ``rows``: the light of each projector pixel. ``variance`` (P,): of one
    sample's light. ``scatter`` (P,): variance of the mean of the replicates' means. ``finds``: for the first
    two turns, the paths that carry light, if they were asked for.
    """

    samples: Ints
    rows: SparseRows
    variance: Floats
    scatter: Floats
    finds: tuple[Finds, ...]


def gather(arrivals: Sequence[Arrival], *, samples: Ints, replicates: Ints, learn: bool) -> Gathered:
    """Rows of pixels whose samples stand one after the other.

    Parameters
    ----------
    arrivals
        The light of each bounce of the paths.
    samples
        (P,) of each pixel; consecutive equal parts of them are the replicates.
    replicates
        (P,) how many parts, at least 2; divides the samples.
    learn
        Whether ``finds`` are wanted.

    Returns
    -------
    An entry for each path and bounce with light, its value the light over ``samples``. O(paths).

    """
    path = np.concatenate([_NONE, *(one.path.numpy() for one in arrivals)])
    order = np.argsort(path, kind="stable")  # each bounce is in order: one merge
    path = path[order]
    pixel = np.concatenate([_NONE, *(one.pixel.numpy() for one in arrivals)])[order]
    weight = np.concatenate([np.zeros(0, np.float32), *(one.weight.numpy() for one in arrivals)])[order]
    first = np.concatenate([[0], np.cumsum(samples)])
    starts = _starts(path, first)
    variance, scatter = _moments(path, weight, starts, first, replicates)
    rows = SparseRows(starts, pixel.astype(np.int32), _shared(weight, starts, samples))
    turns = range(_LEARNT_TURNS) if learn else range(0)
    return Gathered(
        samples, rows, variance, scatter, tuple(_finds(arrivals[turn:], turn, first) for turn in turns)
    )


def _finds(arrivals: Sequence[Arrival], turn: int, first: Ints) -> Finds:
    """Directions at a turn, of the paths that bring light after it or later."""
    path = np.concatenate([_NONE, *(one.path.numpy() for one in arrivals)])
    order = np.argsort(path, kind="stable")
    light = np.concatenate([np.zeros(0, np.float32), *(one.weight.numpy() for one in arrivals)])[order]
    directions = np.concatenate(
        [np.zeros((0, 3), np.float32), *(one.directions[turn].numpy().T for one in arrivals)]
    )
    rows = SparseRows(_starts(path[order], first), np.arange(light.size, dtype=np.int32), light)
    return Finds(rows, directions[order])


def _starts(path: NDArray[np.uint32], first: Ints) -> Ints:
    """First entry of each pixel, from its first path."""
    return np.searchsorted(path, first.astype(np.uint32)).astype(np.int64)


def _shared(weight: Floats32, starts: Ints, samples: Ints) -> Floats32:
    return weight * np.repeat((1.0 / samples).astype(np.float32), np.diff(starts))


@nb.njit(cache=True)
def _moments(
    path: NDArray[np.uint32], weight: Floats32, starts: Ints, first: Ints, replicates: Ints
) -> tuple[Floats, Floats]:
    """Variance of one path's light, and of the mean of the replicates' means, for each pixel."""
    count = replicates.size
    variance, scatter = np.zeros(count), np.zeros(count)
    for p in range(count):
        square, total, spread = 0.0, 0.0, 0.0
        k, samples = starts[p], first[p + 1] - first[p]
        part = samples // replicates[p]
        for r in range(replicates[p]):
            mean, end = 0.0, first[p] + (r + 1) * part
            while k < starts[p + 1] and path[k] < end:
                light = float(weight[k])
                while k + 1 < starts[p + 1] and path[k + 1] == path[k]:  # its later bounces
                    k += 1
                    light += weight[k]
                k += 1
                mean += light / part
                square += light * light
            total += mean
            spread += mean * mean
        mean = total / replicates[p]
        variance[p] = max(square / samples - mean * mean, 0.0) * samples / (samples - 1)
        scatter[p] = max(spread / replicates[p] - mean * mean, 0.0) / (replicates[p] - 1)
    return variance, scatter
