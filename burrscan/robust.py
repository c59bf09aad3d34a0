"""The numbers of robust statistics that several places need, Tukey's weights, and the medians of groups."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats, Ints

TUKEY = 4.685
"""Residuals beyond this many sigma weigh nothing: 95 % efficient on normal noise (Holland & Welsch 1977)."""
MEDIAN_SIZE = 0.6745
"""Median of the size of a normal variable, in its standard deviations."""
MEDIAN_OVER_MEAN = 1.2533
"""Standard error of a median over that of a mean, for normal errors."""
SIGMA_PER_MEDIAN = 1.4826
"""Standard deviation of a normal variable over the median of its size, rounded as the literature does."""


def bisquare(share: Floats) -> Floats:
    """Tukey's weights of residuals that are shares of where they weigh nothing, which is at 1 and beyond."""
    return (1.0 - np.minimum(share**2, 1.0)) ** 2


def medians_of(values: Floats, group: Ints, count: int) -> Floats:
    """(count,) median of the values of each group, the upper of two; NaN where a group has none.

    ``group`` is the number of each value's, below ``count``. O(N log N).
    """
    order = np.lexsort((values, group))
    number, first, size = np.unique(group[order], return_index=True, return_counts=True)
    medians = np.full(count, np.nan)
    medians[number] = values[order[first + size // 2]]
    return medians
