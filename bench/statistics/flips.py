"""Exact paired tests by flipping signs, and the intervals that are these tests turned round.

If a change makes no difference beyond ``centre``, the sign of every scene's ``difference - centre`` is as
good as drawn by lot. A test counts how many of all choices of signs are as one-sided as what was seen. Both
tests here come down to counting which of some sorted numbers lie on one side of ``centre``, so every centre
that a test does not reject lies between two of these numbers: that is the interval, and it can never
contradict the test.

Fisher, The Design of Experiments (1935), section 21; Hartigan, Using subsample values as typical values,
J. Am. Stat. Assoc. 64 (1969); Hodges and Lehmann, Estimates of location based on rank tests, Ann. Math.
Statist. 34 (1963). Both assume that, without a true difference, one is as likely up as down.
"""

from __future__ import annotations

import bisect
import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from burrscan.arrays import Bools, Floats

MOST_ENUMERATED = 20
"""Up to so many scenes all choices of signs are counted: 2^20."""

DRAWN = 99_999
"""Beyond, so many are drawn, always the same ones. With the one that was seen they are 100,000."""

_SEED = 20050718
"""Of the signs drawn: any, but the same in every comparison."""
_CHUNK = 10_000
"""Draws summed at once: bounds memory."""
_DIGITS = 12  # of numbers relative to the largest: what cancels must be zero, not 1e-17


@dataclass(frozen=True, eq=False)
class FlipTest:
    """A test of one number per scene, for any centre.

    Parameters
    ----------
    value
        The estimate: mean, or Hodges and Lehmann's median of all pairs' means. NaN without scenes.
    ordered
        (N,) sorted numbers: the means of subsets of scenes, or of pairs of scenes.
    tail
        (N + 1,) probability, without a true difference, of at most so many of them on one side.
    scenes
        Sample size.
    drawn
        How many choices of signs were drawn; 0 where all were counted.

    """

    value: float
    ordered: Floats
    tail: Floats
    scenes: int
    drawn: int = 0

    @property
    def speaks(self) -> bool:
        """Whether any scene differs at all."""
        return bool(np.any(self.ordered != 0.0))

    def p(self, centre: float = 0.0) -> float:
        """Two-sided p-value of ``centre``; NaN without scenes. O(log N)."""
        if not self.scenes:
            return math.nan
        below = int(np.searchsorted(self.ordered, centre, "right"))
        above = len(self.ordered) - int(np.searchsorted(self.ordered, centre, "left"))
        return min(1.0, 2.0 * float(self.tail[min(below, above)]))

    def interval(self, alpha: float) -> tuple[float, float]:
        """Every centre whose :meth:`p` is above ``alpha``, ends included. O(log N).

        Infinite where even the most one-sided signs are likelier than that: with ``n`` scenes one cannot go
        below ``2 / 2^n``.
        """
        fewest = bisect.bisect_right(self.tail, alpha, key=lambda chance: 2.0 * chance)
        if not self.scenes or fewest == 0:
            return -math.inf, math.inf
        return float(self.ordered[fewest - 1]), float(self.ordered[len(self.ordered) - fewest])


def mean_test(scenes: Floats) -> FlipTest:
    """The sign-flip test of the mean of one number per scene (G,), exact up to 2^20 choices of signs.

    Flipping the scenes of a subset makes the sum larger just where that subset's mean is below the centre: so
    the sorted numbers are the means of all subsets but the empty one. O(2^G), or O(99,999 G).
    """
    count = len(scenes)
    if not count:
        return _nothing()
    if count <= MOST_ENUMERATED:
        means, drawn = _all_means(scenes), 0
    else:
        means, drawn = _drawn_means(scenes), DRAWN
    tail = np.minimum((1.0 + np.arange(len(means) + 1)) / (len(means) + 1), 1.0)
    return FlipTest(float(np.mean(scenes)), _sorted(means, scenes), tail, count, drawn)


def rank_test(scenes: Floats) -> FlipTest:
    """Wilcoxon's signed-rank test of one number per scene (G,), exact for any number of scenes.

    One case cannot carry it, however far out it lies. The sorted numbers are Walsh's means of all pairs of
    scenes, each with itself too. A tie counts against the verdict: breaking it at random would make the test
    exact, and none of these is more cautious. O(G^3).
    """
    count = len(scenes)
    if not count:
        return _nothing()
    i, j = np.triu_indices(count)
    pairs = _sorted((scenes[i] + scenes[j]) / 2.0, scenes)
    return FlipTest(float(np.median(pairs)), pairs, _rank_sums(count), count)


def _nothing() -> FlipTest:
    return FlipTest(math.nan, np.zeros(0), np.ones(1), 0)


def _sorted(values: Floats, scenes: Floats) -> Floats:
    """Sorted, and rounded far below what any measurement resolves."""
    scale = float(np.abs(scenes).max()) or 1.0
    return np.sort(np.round(values / scale, _DIGITS)) * scale


def _all_means(scenes: Floats) -> Floats:
    """Means of the 2^G - 1 subsets: every scene doubles what there is."""
    sums, sizes = np.zeros(1), np.zeros(1)
    for value in scenes:
        sums, sizes = np.concatenate([sums, sums + value]), np.concatenate([sizes, sizes + 1.0])
    means: Floats = sums[1:] / sizes[1:]
    return means


def _drawn_means(scenes: Floats) -> Floats:
    """Means of subsets drawn; an empty one stands for the signs as they were seen: the mean of all."""
    parts = []
    for chunk in _subsets(len(scenes)):
        sizes = chunk.sum(axis=1)
        parts.append(np.where(sizes > 0, chunk @ scenes / np.maximum(sizes, 1), np.mean(scenes)))
    return np.concatenate(parts)


@lru_cache(maxsize=8)
def _subsets(count: int) -> tuple[Bools, ...]:
    """Subsets (99,999, count) in chunks, the same at every call and for every metric."""
    random = np.random.default_rng((_SEED, count))
    drawn = random.integers(0, 2, (DRAWN, count), dtype=np.int8).astype(bool)
    return tuple(drawn[start : start + _CHUNK] for start in range(0, DRAWN, _CHUNK))


@lru_cache(maxsize=64)
def _rank_sums(count: int) -> Floats:
    """Probability of a signed-rank sum of at most 0, 1, …, G(G+1)/2: scene by scene, its rank or nothing."""
    chances = np.zeros(count * (count + 1) // 2 + 1)
    chances[0] = 1.0
    for rank in range(1, count + 1):
        chances[rank:] = (chances[rank:] + chances[:-rank]) / 2.0
        chances[:rank] /= 2.0
    tail: Floats = np.minimum(np.cumsum(chances), 1.0)
    tail.flags.writeable = False
    return tail
