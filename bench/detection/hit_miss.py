"""Hit/miss: a logistic curve through found and missed burrs, with likelihood-ratio intervals."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit, gammaincinv, logit

from bench.detection.curve import PodCurve, crossing, grid, logarithms, size_of
from burrscan.arrays import Bools, Floats
from burrscan.errors import InputError

_TINY = 1e-12
"""Keeps logarithms finite where a curve is 0 or 1 to rounding."""
_DIRECTIONS = 120
"""Rays on which the rim of a likelihood region is found, 3° apart; the region is convex."""
_RIDGE = 1e-6  # keeps the fit finite where misses and hits do not overlap
_STEEPEST = 200.0  # per standard deviation of sizes: a step, for all that data can tell
_SLICES = 7
"""Values of an asymptote for each of which the region of the line is found."""
_LARGEST_ASYMPTOTE = 0.45
"""Below a half, so that a curve still rises through the 50 % that its size is read off at."""


@dataclass(frozen=True)
class _Data:
    """Burrs: standardised places (N,), minus infinity for blank sites, and hits as 0 or 1."""

    z: Floats
    hit: Floats

    def log_likelihood(self, lines: Floats, floor: float, ceiling: float) -> Floats:
        """Of lines (..., 2), as intercept and slope of the log odds."""
        with np.errstate(invalid="ignore", over="ignore"):
            odds = lines[..., :1] + lines[..., 1:] * self.z
        pod = floor + (ceiling - floor) * expit(np.where(np.isneginf(self.z), -np.inf, odds))
        pod = np.clip(pod, _TINY, 1.0 - _TINY)
        return np.asarray((self.hit * np.log(pod) + (1.0 - self.hit) * np.log1p(-pod)).sum(axis=-1), float)

    def best_line(self, floor: float, ceiling: float) -> Floats:
        """The most likely line for given asymptotes."""

        def cost(line: Floats) -> tuple[float, Floats]:
            likelihood = float(self.log_likelihood(line, floor, ceiling))
            downhill = 2.0 * _RIDGE * line - self._gradient(line, floor, ceiling)
            return float(_RIDGE * line @ line) - likelihood, np.asarray(downhill, np.float64)

        share = float(np.clip(self.hit.mean(), 0.02, 0.98))
        starts = [np.array([float(logit(share)), slope]) for slope in (0.5, 3.0)]
        # with ends of 0 and 1 the likelihood is concave, and any start will do
        one_top = floor == 0.0 and ceiling == 1.0
        fits = [minimize(cost, start, method="BFGS", jac=True) for start in starts[: 1 if one_top else 2]]
        best: Floats = min(fits, key=lambda fit: float(fit.fun)).x
        return best

    def _gradient(self, line: Floats, floor: float, ceiling: float) -> Floats:
        """Of the log likelihood by intercept and slope (2,); blank sites do not depend on the line."""
        known = np.isfinite(self.z)
        z, hit = self.z[known], self.hit[known]
        share = expit(line[0] + line[1] * z)
        pod = np.clip(floor + (ceiling - floor) * share, _TINY, 1.0 - _TINY)
        by_odds = (hit - pod) / (pod * (1.0 - pod)) * (ceiling - floor) * share * (1.0 - share)
        return np.array([by_odds.sum(), (by_odds * z).sum()])


@dataclass(frozen=True)
class _Slice:
    """Lines on the rim of the likelihood region (D, 2) for given asymptotes."""

    floor: float
    ceiling: float
    rim: Floats

    def pod(self, z: float, pick: str) -> float:
        """The lowest or the highest curve of the region at a place."""
        odds = self.rim[:, 0] + self.rim[:, 1] * z
        extreme = odds.min() if pick == "low" else odds.max()
        return float(self.floor + (self.ceiling - self.floor) * expit(extreme))


def fit_hit_miss(size: Floats, hit: Bools, *, floor: bool = False, ceiling: bool = False) -> PodCurve:
    """Fit ``POD(a) = floor + (ceiling - floor) * logistic(b0 + b1 x)`` with x = log a.

    Maximum likelihood. Intervals hold every parameter value whose likelihood ratio to the best one is not
    rejected (chi-squared, one degree of freedom, so pointwise); they keep their meaning for few burrs and for
    hits and misses that do not overlap, where Wald's fail. ASTM E2862 uses the same likelihood. O(N) per
    evaluation, some 10^4 evaluations, with asymptotes fifty times as many.

    Parameters
    ----------
    size
        (N,) sizes of true burrs, such as heights in mm; 0 for a blank site, which tells of the floor.
    hit
        (N,) whether each was found.
    floor, ceiling
        Whether the curve has asymptotes of its own above 0 (false calls that fall on a burr) and below 1
        (burrs that no light reaches), or ends at 0 and 1.

    Raises
    ------
    InputError
        When there are fewer than two sizes.

    """
    x = logarithms(np.asarray(size, float))
    known = x[np.isfinite(x)]
    if len(np.unique(known)) < 2:
        raise InputError("a detection curve needs burrs of at least two sizes; state the share found instead")
    centre, spread = float(known.mean()), float(known.std())
    data = _Data((x - centre) / spread, np.asarray(hit, float))
    line, low_end, high_end = _best(data, floor=floor, ceiling=ceiling)
    fit = (line, low_end, high_end)
    two_sided = _region(data, fit, 0.95, floor=floor, ceiling=ceiling)
    one_sided = _region(data, fit, 0.90, floor=floor, ceiling=ceiling)
    places = grid(x)
    z = (places - centre) / spread

    def size_at(level: float, slices: list[_Slice], pick: str) -> float:
        at = crossing(z, lambda v: _extreme(slices, v, pick), level)
        return size_of(centre + spread * at)

    def fitted(level: float) -> float:
        if data.hit.all() or not data.hit.any() or line[1] <= 0.0 or not low_end < level < high_end:
            return float("nan")
        at = (float(logit((level - low_end) / (high_end - low_end))) - line[0]) / line[1]
        return size_of(centre + spread * at)

    return PodCurve(
        size=np.exp(places),
        pod=low_end + (high_end - low_end) * expit(line[0] + line[1] * z),
        low=np.array([_extreme(two_sided, v, "low") for v in z]),
        high=np.array([_extreme(two_sided, v, "high") for v in z]),
        a50=fitted(0.5),
        a90=fitted(0.9),
        a90_interval=(size_at(0.9, two_sided, "high"), size_at(0.9, two_sided, "low")),
        a90_95=size_at(0.9, one_sided, "low"),
        floor=low_end,
        ceiling=high_end,
        trials=len(known),
    )


def _best(data: _Data, *, floor: bool, ceiling: bool) -> tuple[Floats, float, float]:
    """The most likely line and asymptotes."""
    if not (floor or ceiling):
        return data.best_line(0.0, 1.0), 0.0, 1.0
    bounds = [
        (None, None),
        (None, _STEEPEST),
        (0.0, _LARGEST_ASYMPTOTE if floor else 0.0),
        (0.0, _LARGEST_ASYMPTOTE if ceiling else 0.0),
    ]

    def cost(p: Floats) -> float:
        return float(_RIDGE * p[:2] @ p[:2] - data.log_likelihood(p[:2], p[2], 1.0 - p[3]))

    fits = []
    for low, lost in itertools.product((0.0, 0.1) if floor else (0.0,), (0.0, 0.1) if ceiling else (0.0,)):
        start = np.array([*data.best_line(low, 1.0 - lost), low, lost])
        fits.append(minimize(cost, start, method="L-BFGS-B", bounds=bounds))
    best = min(fits, key=lambda fit: float(fit.fun)).x
    return best[:2], float(best[2]), 1.0 - float(best[3])


def _region(
    data: _Data, fit: tuple[Floats, float, float], level: float, *, floor: bool, ceiling: bool
) -> list[_Slice]:
    """The likelihood region around a fit (line, floor, ceiling), cut at several asymptotes."""
    line, low, high = fit
    least = float(data.log_likelihood(line, low, high)) - float(
        gammaincinv(0.5, level)
    )  # half of chi-squared
    shares = (low, 1.0 - high)
    floors = _plausible(data, least, shares, 0) if floor else [0.0]
    lost = _plausible(data, least, shares, 1) if ceiling else [0.0]
    slices = []
    for a, b in itertools.product(floors, lost):
        best = data.best_line(a, 1.0 - b)
        if data.log_likelihood(best, a, 1.0 - b) >= least:
            slices.append(_Slice(a, 1.0 - b, _rim(data, best, least, a, 1.0 - b)))
    return slices


def _plausible(data: _Data, least: float, shares: tuple[float, float], which: int) -> list[float]:
    """Values of one asymptote's share that the data allow, whatever the other one is.

    ``shares`` are the best ones, at the floor and lost at the ceiling; ``which`` of them to vary.
    """

    def allowed(value: float) -> bool:
        others = {shares[1 - which], 0.0, 0.03, 0.1, 0.2}
        pairs = ((value, other) if which == 0 else (other, value) for other in others)
        return any(float(data.log_likelihood(data.best_line(a, 1 - b), a, 1 - b)) >= least for a, b in pairs)

    first, last = (_last_allowed(allowed, shares[which], end) for end in (0.0, _LARGEST_ASYMPTOTE))
    return [first + (last - first) * step / (_SLICES - 1) for step in range(_SLICES)]


def _last_allowed(allowed: Callable[[float], bool], inside: float, outside: float) -> float:
    """The value nearest to ``outside`` that is still allowed."""
    if allowed(outside):
        return outside
    for _ in range(7):
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if allowed(middle) else (inside, middle)
    return inside


def _rim(data: _Data, line: Floats, least: float, floor: float, ceiling: float) -> Floats:
    """Lines (D, 2) around the best one at which the likelihood has fallen to ``least``.

    For fixed ends of 0 and 1 the likelihood is concave in the line, so that the region is convex and every
    ray leaves it once; the extremes of a curve's log odds are then on its rim.
    """
    angles = np.linspace(0.0, 2.0 * np.pi, _DIRECTIONS, endpoint=False)
    rays = np.column_stack([np.cos(angles), np.sin(angles)]) @ _whitening(data, line, floor, ceiling)
    inside, outside = np.zeros(_DIRECTIONS), np.full(_DIRECTIONS, 1e-3)
    for _ in range(40):  # doubled until the ray is outside, or as steep as data can tell
        reached = line + outside[:, None] * rays
        going = (data.log_likelihood(reached, floor, ceiling) > least) & (abs(reached[:, 1]) < _STEEPEST)
        if not going.any():
            break
        inside, outside = np.where(going, outside, inside), np.where(going, 2.0 * outside, outside)
    for _ in range(25):
        middle = 0.5 * (inside + outside)
        within = data.log_likelihood(line + middle[:, None] * rays, floor, ceiling) > least
        inside, outside = np.where(within, middle, inside), np.where(within, outside, middle)
    return np.asarray(line + inside[:, None] * rays, float)


def _whitening(data: _Data, line: Floats, floor: float, ceiling: float) -> Floats:
    """A matrix (2, 2) that makes the region about round: the root of the inverse information."""
    known = np.isfinite(data.z)
    design = np.column_stack([np.ones(int(known.sum())), data.z[known]])
    share = expit(design @ line)
    pod = np.clip(floor + (ceiling - floor) * share, 1e-6, 1.0 - 1e-6)
    weight = ((ceiling - floor) * share * (1.0 - share)) ** 2 / (pod * (1.0 - pod))
    information = design.T @ (weight[:, None] * design) + 1e-4 * np.eye(2)
    root: Floats = np.linalg.cholesky(np.linalg.inv(information)).T
    return root


def _extreme(slices: list[_Slice], z: float, pick: str) -> float:
    pods = [part.pod(z, pick) for part in slices]
    return min(pods) if pick == "low" else max(pods)
