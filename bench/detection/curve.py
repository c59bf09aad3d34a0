"""What a fit of either kind says, and shares with exact bounds."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bench.statistics.share import share_bounds
from burrscan.arrays import Bools, Floats
from burrscan.errors import InputError

_BINS = 8  # shares found at more places would hide the curve


@dataclass(frozen=True)
class PodCurve:
    """A fitted curve of the probability of detection (POD) over size.

    Parameters
    ----------
    size, pod, low, high
        (K,) the curve over the logarithm of size, with its pointwise two-sided 95 % band.
    a50, a90
        Sizes detected with a probability of 0.5 and 0.9; NaN where the curve does not get there, or no size
        was missed.
    a90_interval
        Of a90, two-sided, 95 %.
    a90_95
        The upper 95 % confidence bound of a90: infinite where these data do not show that any size is
        detected with 0.9.
    floor, ceiling
        The curve's asymptotes: what is "detected" by false calls alone, and what the largest burrs reach.
    trials
        Burrs there were.

    """

    size: Floats
    pod: Floats
    low: Floats
    high: Floats
    a50: float
    a90: float
    a90_interval: tuple[float, float]
    a90_95: float
    floor: float
    ceiling: float
    trials: int

    def told(self, value: float) -> str:
        """A size as text; beyond the sizes that were tried, where the curve is a guess, none is stated."""
        low, high = float(self.size[0]), float(self.size[-1])
        if math.isnan(value):
            return "–"
        if value < low:
            return f"< {low:.2g}"
        return f"{value:.3g}" if value <= high else f"> {high:.2g}"


@dataclass(frozen=True)
class Share:
    """Found of all burrs near one size, with exact two-sided 95 % bounds."""

    size: float
    hits: int
    trials: int
    low: float
    high: float


def shares(size: Floats, hit: Bools) -> tuple[Share, ...]:
    """Shares found at each size, or in groups of equal number where there are more sizes than eight."""
    edges = np.unique(size)
    if len(edges) > _BINS:
        edges = np.unique(np.quantile(size, np.linspace(0.0, 1.0, _BINS + 1))[:-1])
    group = np.searchsorted(edges, size, side="right")
    found = []
    for number in np.unique(group):
        here = group == number
        hits, trials = int(hit[here].sum()), int(here.sum())
        found.append(Share(float(size[here].mean()), hits, trials, *share_bounds(hits, trials)))
    return tuple(found)


def logarithms(size: Floats) -> Floats:
    """Places of sizes on the axis on which the curve is straight; blank sites (0) are at minus infinity.

    Raises
    ------
    InputError
        When a size is negative or not finite.

    """
    if not np.all(np.isfinite(size) & (size >= 0.0)):
        raise InputError("sizes of burrs must be finite and not negative")
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(size), float)


def size_of(place: float) -> float:
    """Back to a size; NaN stays NaN."""
    with np.errstate(over="ignore"):
        return float(np.exp(place))


def grid(x: Floats) -> Floats:
    """Places (K,) on the curve's axis that cover the sizes seen and a little more."""
    known = x[np.isfinite(x)]
    room = 0.15 * float(np.ptp(known))
    return np.linspace(float(known.min()) - room, float(known.max()) + room, 81)


def crossing(x: Floats, height: Callable[[float], float], level: float) -> float:
    """Where a rising function passes ``level``: looked for on ``x`` stretched tenfold; infinite if nowhere.

    Minus infinity when it is above ``level`` from the start.
    """
    middle, half = 0.5 * float(x[0] + x[-1]), 0.5 * float(x[-1] - x[0])
    low, high = middle - 10.0 * half, middle + 10.0 * half
    if height(low) >= level:
        return -np.inf
    if height(high) < level:
        return np.inf
    for _ in range(60):
        centre = 0.5 * (low + high)
        low, high = (low, centre) if height(centre) >= level else (centre, high)
    return 0.5 * (low + high)
