"""Paired yes-or-no outcomes: McNemar's exact test and Tango's score interval."""

from __future__ import annotations

import math

from scipy.optimize import brentq
from scipy.stats import binomtest, norm


def mcnemar_exact(lost: int, gained: int) -> float:
    """Two-sided p-value of McNemar's exact test.

    Under the null hypothesis a discordant pair falls to either side with probability 1/2.

    Parameters
    ----------
    lost, gained
        Pairs that turned from yes to no, and from no to yes.

    """
    return float(binomtest(lost, lost + gained, 0.5).pvalue) if lost + gained else 1.0


def tango_interval(lost: int, gained: int, pairs: int, *, level: float = 0.95) -> tuple[float, float]:
    """Score interval of the difference of two paired shares, new minus old.

    It keeps its coverage with few discordant pairs, where Wald's collapses: none among ``n`` pairs gives
    about ±z²/(n + z²). Tango, Equivalence test and confidence interval for the difference in proportions for
    the paired-sample design, Statistics in Medicine 17 (1998). O(1).

    Parameters
    ----------
    lost, gained
        Pairs that turned from yes to no, and from no to yes.
    pairs
        All pairs.
    level
        Coverage.

    """
    z = float(norm.ppf(0.5 + level / 2.0))
    observed = (gained - lost) / pairs

    def score(difference: float) -> float:
        return _score(lost, gained, pairs, difference)

    end = 1.0 - 1e-12
    low = -1.0 if score(-end) <= z else brentq(lambda d: score(d) - z, -end, min(observed, end))
    high = 1.0 if score(end) >= -z else brentq(lambda d: score(d) + z, max(observed, -end), end)
    return float(low), float(high)


def _score(lost: int, gained: int, pairs: int, difference: float) -> float:
    """Tango's statistic: falls with the difference assumed, zero at the observed one."""
    a = 2.0 * pairs
    b = -gained - lost + (2.0 * pairs - gained + lost) * difference
    c = -lost * difference * (1.0 - difference)
    share = (math.sqrt(max(b * b - 4.0 * a * c, 0.0)) - b) / (2.0 * a)  # lost, under that difference
    variance = pairs * (2.0 * share + difference * (1.0 - difference))
    excess = gained - lost - pairs * difference
    if variance <= 0.0:
        return math.copysign(math.inf, excess) if excess else 0.0
    return excess / math.sqrt(variance)
