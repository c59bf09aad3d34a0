"""How high a burr is where it is highest: rows of vertices tell its course along the length.

A mean over some length is lower than the highest place in it, and the highest of many noisy rows is higher
than any place. So the course is taken for a random process, and the answer is the mean of its largest value
over all courses that the rows allow.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.ndimage import binary_dilation

from burrscan.arrays import Bools, Floats, Ints
from burrscan.burrs.shape.patch import Patch
from burrscan.burrs.shape.ridge import HUBER, Ridge, between, huber

_FEWEST = 3
"""Rows from which their differences say anything."""
_MOST = 63
"""Rows that a burr is cut into: of a longer one they are longer."""
_SEEN = 0.2
"""Share of the usual weight below which a row is not seen, and tells no course."""
_GAP = 0.5
"""Share of the usual height: what is surely lower (by two standard deviations) is a gap in the burr."""
_SPREADS = np.array([0.03, 0.06, 0.12, 0.25, 0.5])
"""Standard deviations of a course, shares of the height: rows hide less, and more is in pieces."""
_REACHES = np.array([2.0, 4.0, 8.0, 16.0])
"""Over which a course is alike (correlation 1/e), in rows: what is shorter no row shows."""
_NOISES = np.array([1.0, 2.0, 4.0])
"""Variance of a row over what it states: where few vertices lie across a burr, what is between them."""
_EVEN = 1.0 / (1 + len(_SPREADS))
"""Prior probability of a burr as high all along, the same as of each spread. Of 45 burrs on rendered metal
heights are off by 12.8 % (root mean square) with 0.2, 13.9 with 0.5 and 12.1 with 0.05; of twelve that are
even by 9.0, 8.8 and 9.4."""
_UNLIKELY = 1e-3
"""Share of the evidence below which a spread, reach and noise are not followed."""
_DRAWS = np.random.default_rng(0).standard_normal((_MOST + 1, 1, 256))
"""The same for every burr: a height depends on its rows alone. Of a largest value's spread they leave 6 %."""


def height_of(patch: Patch, ridge: Ridge, *, row_mm: float) -> tuple[float, float]:
    """Largest height along the burr and its standard deviation; rows of ``row_mm`` tell it. O(N + rows)."""
    sigma = ridge.sigma_of([1, 0, 0, 0, 0])
    length = ridge.end_mm - ridge.start_mm
    count = int(np.clip(length / row_mm, 1, _MOST))
    if count < _FEWEST:
        return ridge.height_mm, sigma
    part = between(patch, (ridge.start_mm, ridge.end_mm))
    row = np.minimum((part.u_mm - ridge.start_mm) / length * count, count - 1).astype(np.int64)
    share, weight, misfit = _relative_heights(part, ridge, row, count)
    most, most_sigma = highest(share, weight / max(1.0, misfit))
    return ridge.height_mm * most, float(np.hypot(sigma * most, ridge.height_mm * most_sigma))


def _relative_heights(patch: Patch, ridge: Ridge, row: Ints, count: int) -> tuple[Floats, Floats, float]:
    """Height of each row over the ridge's, its weight (none where it is not seen), and the misfit.

    The misfit is what is left when every row has its own height: differences along the burr, which are to be
    found, must not hide themselves.
    """
    model = ridge.height_mm * ridge.shape(patch)
    residual = np.abs(patch.lift_mm - model)
    w = np.minimum(1.0, HUBER * patch.sigma_mm / np.maximum(residual, 1e-300)) / patch.sigma_mm**2
    weight = np.bincount(row, weights=w * model**2, minlength=count).astype(np.float64)
    match = np.bincount(row, weights=w * model * patch.lift_mm, minlength=count)
    share = match / np.maximum(weight, 1e-300)
    left = np.abs(patch.lift_mm - share[row] * model) / patch.sigma_mm
    return share, weight, float(huber(left).sum()) / max(len(left) - count, 1)


def highest(share: Floats, weight: Floats) -> tuple[float, float]:
    """Mean and standard deviation of the largest height along a burr, over the mean of its rows.

    Parameters
    ----------
    share
        (N,) height of each row, in their order, above 0 in the mean.
    weight
        (N,) inverse variance; far below the usual where a row is not seen.

    Notes
    -----
    The course is a stationary Gaussian process without memory but for its value (Ornstein & Uhlenbeck 1930),
    the least smooth that has a reach, about an unknown mean. Spread, reach and noise have the weight of their
    evidence (Rasmussen & Williams 2006, sections 2.7 and 5.2), a burr as high all along among them; of each
    the largest value is that of courses drawn backwards from the filtered rows (Carter & Kohn 1994). What is
    torn off is no low place of a course: taken for one, gaps make an even burr 0.2 higher at a noise of 0.08.
    O(N · spreads · reaches · noises · draws), of one row at a time: no BLAS, the same bits on any machine.

    """
    seen = weight > _SEEN * np.median(weight)
    if not seen.any():
        return 1.0, 0.0
    rows = np.flatnonzero(seen & ~_gaps(share, weight, seen))
    if len(rows) < _FEWEST:
        return 1.0, 0.0
    h, w = share[rows], weight[rows]
    mean = float((w * h).sum() / w.sum())
    usual = float((weight * share)[seen].sum() / weight[seen].sum())  # the ridge's, whose fit saw the gaps
    if usual <= 0.0:
        return 1.0, 0.0
    spread, reach, noise = (each.ravel() for each in np.meshgrid(_SPREADS, _REACHES, _NOISES))
    courses = _filtered(h, noise / w[:, None], np.exp(-np.diff(rows)[:, None] / reach), spread)
    left = float((w * (h - mean) ** 2).sum())
    even = 0.5 * (np.log(w).sum() - np.log(w.sum()) - (len(w) - 1) * np.log(_NOISES) - left / _NOISES)
    prior = np.repeat([(1.0 - _EVEN) / len(spread), _EVEN / len(even)], [len(spread), len(even)])
    log = np.append(courses.evidence, even) + np.log(prior)
    odds = np.exp(log - log.max())
    odds[odds < _UNLIKELY * odds.sum()] = 0.0
    odds /= odds.sum()
    likely = np.flatnonzero(odds[: len(spread)])
    most, variance = np.full(len(odds), mean), np.zeros(len(odds))
    if len(likely):
        largest = courses.only(likely).largest()
        most[likely], variance[likely] = largest.mean(axis=1), largest.var(axis=1)
    answer = float((odds * most).sum())
    return answer / usual, float(np.sqrt((odds * (variance + (most - answer) ** 2)).sum())) / usual


def _gaps(share: Floats, weight: Floats, seen: Bools) -> Bools:
    """(N,) rows where the burr is torn off, and those beside them, of which a part is."""
    above = share + 2.0 / np.sqrt(np.maximum(weight, 1e-300))
    return np.asarray(binary_dilation(seen & (above < _GAP * np.median(share[seen]))))


class _Courses(NamedTuple):
    """N rows filtered for K spreads, reaches and noises.

    ``value`` (N, K) and ``level`` (N, K) are what the rows up to each let its height be about a mean of 0,
    and what a mean of 1 takes off that; ``variance`` (N, K) what they leave. ``kept`` (N - 1, K) is the
    correlation from row to row, ``spread`` (K,). ``mean`` (K,) and its ``precision`` come from all rows, as
    the ``evidence`` (K,), a logarithm.
    """

    value: Floats
    level: Floats
    variance: Floats
    kept: Floats
    spread: Floats
    mean: Floats
    precision: Floats
    evidence: Floats

    def only(self, which: Ints) -> _Courses:
        """Some of the K."""
        return _Courses(*(each[..., which] for each in self))

    def largest(self) -> Floats:
        """(K, draws) largest value of courses drawn from what all rows allow."""
        mean = self.mean[:, None] + _DRAWS[-1] / np.sqrt(self.precision)[:, None]
        drawn: Floats = np.full_like(mean, -np.inf)
        most = drawn
        for i in range(len(self.value) - 1, -1, -1):
            at = self.value[i][:, None] - mean * self.level[i][:, None]
            left = self.variance[i]
            if i < len(self.kept):
                kept = self.kept[i]
                ahead = self.spread**2 + kept**2 * (left - self.spread**2)
                gain = left * kept / ahead
                at = at + gain[:, None] * (drawn - kept[:, None] * at)
                left = np.maximum(left - gain**2 * ahead, 0.0)
            drawn = at + np.sqrt(left)[:, None] * _DRAWS[i]
            most = np.maximum(most, drawn)
        return np.asarray(most + mean)


def _filtered(height: Floats, variance: Floats, kept: Floats, spread: Floats) -> _Courses:
    """Kalman's filter over the rows, of their heights (N,) and, for the unknown mean, of ones."""
    ahead, states = spread**2, np.zeros((2, len(spread)))
    squares, log = np.zeros((3, len(spread))), np.zeros(len(spread))
    values, levels, left = (np.empty((len(height), len(spread))) for _ in range(3))
    for i, (seen, own) in enumerate(zip(height, variance, strict=True)):
        if i:
            states = kept[i - 1] * states
            ahead = spread**2 + kept[i - 1] ** 2 * (ahead - spread**2)
        off, total = np.array([[seen], [1.0]]) - states, ahead + own
        squares += np.stack([off[0] ** 2, off[0] * off[1], off[1] ** 2]) / total
        log += np.log(total)
        states = states + ahead / total * off
        ahead = ahead * own / total
        (values[i], levels[i]), left[i] = states, ahead
    mean = squares[1] / squares[2]
    evidence = -0.5 * (log + np.log(squares[2]) + squares[0] - squares[1] * mean)
    return _Courses(values, levels, left, kept, spread, mean, squares[2], evidence)
