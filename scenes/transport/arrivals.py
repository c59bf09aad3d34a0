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
LEARNT_TURNS = 2
"""A fourth surface adds nothing that could be seen: the turn towards it is not learnt."""

PART_BITS = 2
"""A net has four parts, which are nets, too: bits of a point's number, below the highest, that name the part.
Halves and quarters show the error of their mean, and how it falls with the number of points."""


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
    sample's light. ``halves``, ``quarters`` (P,): what the halves of a net, and the quarters in each, say of
    the variance of their mean, as if they were independent. ``finds``: for the first two turns, the paths
    that carry light, if they were asked for.
    """

    samples: Ints
    rows: SparseRows
    variance: Floats
    halves: Floats
    quarters: Floats
    finds: tuple[Finds, ...]


def gather(arrivals: Sequence[Arrival], *, samples: Ints, learn: bool) -> Gathered:
    """Rows of pixels whose samples stand one after the other.

    Parameters
    ----------
    arrivals
        The light of each bounce of the paths.
    samples
        (P,) of each pixel; a power of two of at least 8 where the scatter of parts is to mean anything.
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
    variance, halves, quarters = _moments(path, weight, starts, first)
    rows = SparseRows(starts, pixel.astype(np.int32), _shared(weight, starts, samples))
    turns = range(LEARNT_TURNS) if learn else range(0)
    return Gathered(
        samples,
        rows,
        variance,
        halves,
        quarters,
        tuple(_finds(arrivals[turn:], turn, first) for turn in turns),
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
    path: NDArray[np.uint32], weight: Floats32, starts: Ints, first: Ints
) -> tuple[Floats, Floats, Floats]:
    """For each pixel, variance of one path's light, and of the mean by the halves and quarters of its net."""
    count = first.size - 1
    variance, halves, quarters = np.zeros(count), np.zeros(count), np.zeros(count)
    parts = 1 << PART_BITS
    means = np.zeros(parts)
    for p in range(count):
        means[:] = 0.0
        square, samples = 0.0, first[p + 1] - first[p]
        k = starts[p]
        while k < starts[p + 1]:
            one, light = path[k], 0.0
            while k < starts[p + 1] and path[k] == one:  # all its bounces
                light += weight[k]
                k += 1
            square += light * light
            means[((one - first[p]) * 2 * parts // samples) % parts] += light
        means *= parts / samples
        variance[p] = max(square / samples - means.mean() ** 2, 0.0) * samples / (samples - 1)
        halves[p] = 0.0625 * (means[0] + means[1] - means[2] - means[3]) ** 2
        quarters[p] = 0.125 * ((means[0] - means[1]) ** 2 + (means[2] - means[3]) ** 2)
    return variance, halves, quarters
