"""Signal response: how the measured size follows the true one, and what a threshold on it detects."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit, logit, ndtr, ndtri, stdtrit

from bench.detection.curve import PodCurve, grid, logarithms, size_of
from burrscan.arrays import Bools, Floats
from burrscan.errors import InputError

_LOGIT_OF_NONE = -12.0  # a share of hidden burrs below 1e-5 is none


@dataclass(frozen=True)
class _Data:
    """Burrs: places (N,), responses on their scale (N,), NaN where below the threshold ``least``."""

    x: Floats
    y: Floats
    least: float
    hidden: bool

    def cost(self, p: Floats) -> float:
        """Minus the log likelihood of (b0, b1, log s[, logit of the hidden share])."""
        line, spread = p[0] + p[1] * self.x, float(np.exp(p[2]))
        lost = float(expit(p[3])) if self.hidden else 0.0
        seen = np.isfinite(self.y)
        missed = lost + (1.0 - lost) * ndtr((self.least - line[~seen]) / spread)
        z = (self.y[seen] - line[seen]) / spread
        found = -0.5 * z**2 - np.log(spread * np.sqrt(2.0 * np.pi)) + np.log1p(-lost)
        return -float(found.sum() + np.log(np.maximum(missed, 1e-300)).sum())


def fit_signal(
    size: Floats,
    response: Floats,
    *,
    threshold: float,
    hidden: bool = False,
    blanks: tuple[int, int] | None = None,
) -> PodCurve:
    """Fit ``log response = b0 + b1 x + normal error``, x = log a, and the POD of a decision threshold.

    Responses below the threshold are not reported, so missed burrs are censored there (maximum likelihood of
    a censored regression, ASTM E3023 and MIL-HDBK-1823A, appendix G), with the error's spread corrected for
    the two parameters of the line. Intervals are those of the delta method, as in both, of the log odds of
    POD and of x at a90, with Student's quantiles. O(N) per evaluation, some 300 evaluations.

    Parameters
    ----------
    size
        (N,) true sizes, such as heights in mm, above 0.
    response
        (N,) measured sizes; NaN for burrs that were missed.
    threshold
        Measured size from which a burr is reported.
    hidden
        Whether some share of burrs stays hidden however large they are; it is estimated, and lowers the
        curve's upper end.
    blanks
        False calls and blank sites of a burr's extent, which raise the curve's lower end.

    Raises
    ------
    InputError
        When there are fewer than three burrs found, or fewer than two sizes.

    """
    data = _checked(size, response, threshold, hidden=hidden)
    best, covariance = _fitted(data)
    calls, sites = blanks or (0, 1)
    floor = calls / sites
    # the false calls are one more parameter, known independently of the line
    theta = np.append(best, floor)
    spread = np.zeros((len(theta), len(theta)))
    spread[:-1, :-1] = covariance
    spread[-1, -1] = floor * (1.0 - floor) / sites
    wide, one_sided = (float(stdtrit(np.isfinite(data.y).sum() - 2, q)) for q in (0.975, 0.95))
    x = grid(data.x)
    odds = _odds(theta, x, data)
    error = _standard_error(lambda p: _odds(p, x, data), theta, spread)
    a50, _ = _place(0.5, theta, spread, data)
    a90, a90_error = _place(0.9, theta, spread, data)

    def size_at(place: float, error: float) -> float:
        """A bound; one that is not there says nothing."""
        if np.isnan(place) and error:
            return float(np.inf) if error > 0.0 else 0.0
        return size_of(place + error)

    return PodCurve(
        size=np.exp(x),
        pod=expit(odds),
        low=expit(odds - wide * error),
        high=expit(odds + wide * error),
        a50=size_of(a50),
        a90=size_of(a90),
        a90_interval=(size_at(a90, -wide * a90_error), size_at(a90, wide * a90_error)),
        a90_95=size_at(a90, one_sided * a90_error),
        floor=floor,
        ceiling=_ceiling(theta, data),
        trials=len(data.x),
    )


def _checked(size: Floats, response: Floats, threshold: float, *, hidden: bool) -> _Data:
    x = logarithms(np.asarray(size, float))
    known = np.asarray(response, float)
    seen: Bools = np.isfinite(known) & (known >= threshold)
    if not np.isfinite(x).all() or len(np.unique(x)) < 2 or seen.sum() < 3:
        raise InputError("a signal response needs at least three burrs found and two sizes above zero")
    if threshold <= 0.0:
        raise InputError("the threshold must be above zero")
    y = np.full(len(x), np.nan)
    y[seen] = np.log(known[seen])
    return _Data(x, y, float(np.log(threshold)), hidden)


def _fitted(data: _Data) -> tuple[Floats, Floats]:
    """Best parameters and their covariance, the inverse of the observed information."""
    seen = np.isfinite(data.y)
    slope, start = np.polyfit(data.x[seen], data.y[seen], 1) if np.ptp(data.x[seen]) else (1.0, 0.0)
    spread = max(float(np.std(data.y[seen] - start - slope * data.x[seen])), 1e-3)
    first = np.array([start, slope, np.log(spread), *([-2.0] if data.hidden else [])])
    best: Floats = np.asarray(
        minimize(data.cost, first, method="Nelder-Mead", options={"xatol": 1e-7, "fatol": 1e-9}).x, np.float64
    )
    if data.hidden and best[3] < _LOGIT_OF_NONE:
        best[3] = _LOGIT_OF_NONE
    covariance = np.asarray(np.linalg.pinv(_hessian(data.cost, best), hermitian=True), np.float64)
    found = int(np.isfinite(data.y).sum())
    best[2] += 0.5 * np.log(found / (found - 2))  # the spread about a line, free of the likelihood's bias
    return best, covariance


def _hessian(cost: Callable[[Floats], float], at: Floats) -> Floats:
    steps = np.diag(1e-3 * np.maximum(np.abs(at), 0.1))
    count = len(at)
    out: Floats = np.empty((count, count))
    for i in range(count):
        for j in range(count):
            a, b = steps[i], steps[j]
            corners = cost(at + a + b) - cost(at + a - b) - cost(at - a + b) + cost(at - a - b)
            out[i, j] = corners / (4.0 * steps[i, i] * steps[j, j])
    return 0.5 * (out + out.T)


def _ceiling(theta: Floats, data: _Data) -> float:
    return 1.0 - float(expit(theta[3])) if data.hidden else 1.0


def _odds(theta: Floats, x: Floats, data: _Data) -> Floats:
    """Log odds (K,) of POD at places; the last parameter is the floor."""
    share = ndtr((theta[0] + theta[1] * x - data.least) / np.exp(theta[2]))
    floor = float(np.clip(theta[-1], 0.0, 1.0))
    pod = floor + (1.0 - floor) * _ceiling(theta, data) * share
    return np.asarray(logit(np.clip(pod, 1e-12, 1.0 - 1e-12)), float)


def _standard_error(function: Callable[[Floats], Floats], theta: Floats, covariance: Floats) -> Floats:
    """Of every value of a function of the parameters, by its derivatives."""
    steps = 1e-4 * np.maximum(np.abs(theta), 0.01)
    columns = [
        (function(theta + step) - function(theta - step)) / (2.0 * size)
        for step, size in zip(np.diag(steps), steps, strict=True)
    ]
    jacobian = np.stack(columns, axis=-1)
    variance = np.einsum("...i,ij,...j->...", jacobian, covariance, jacobian)
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)), np.float64)


def _place(level: float, theta: Floats, covariance: Floats, data: _Data) -> tuple[float, float]:
    """Where on the curve's axis a probability is reached, and the standard error of that.

    NaN where it is not reached; an infinite error where the ceiling is within its own error of the level.
    """

    def place(p: Floats) -> Floats:
        floor = float(np.clip(p[-1], 0.0, 1.0))
        share = (level - floor) / ((1.0 - floor) * _ceiling(p, data))
        inner = ndtri(share) if 0.0 < share < 1.0 else np.nan
        return np.array([(data.least + np.exp(p[2]) * inner - p[0]) / p[1]])

    middle = float(place(theta)[0])
    if theta[1] <= 0.0 or not np.isfinite(middle):
        return float("nan"), np.inf
    error = float(_standard_error(place, theta, covariance)[0])
    return middle, error if np.isfinite(error) else np.inf
