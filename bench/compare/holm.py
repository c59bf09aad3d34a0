"""Holm's step-down correction."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats


def holm(p_values: Floats) -> Floats:
    """Adjusted p-values (N,): reject those at most alpha, and no true null hypothesis of the family falls
    with a probability above alpha, however the tests depend on each other.

    Holm, A simple sequentially rejective multiple test procedure, Scand. J. Statist. 6 (1979). O(N log N).
    """  # noqa: D205 (one sentence)
    order = np.argsort(p_values, kind="stable")
    steps = np.arange(len(p_values), 0, -1)
    adjusted = np.minimum(np.maximum.accumulate(p_values[order] * steps), 1.0)
    out: Floats = np.empty(len(p_values))
    out[order] = adjusted
    return out


def holm_levels(p_values: Floats, alpha: float) -> Floats:
    """The level (N,) at which Holm's procedure tests each: a p-value at most its level is rejected.

    The smallest p-value is tested at ``alpha / N``, the next at ``alpha / (N - 1)``, and so on until one is
    not rejected; that one and all that are larger keep its level. An interval of level ``1 - level``
    therefore leaves out zero just where Holm rejects. O(N log N).

    Parameters
    ----------
    p_values
        (N,) two-sided p-values of one family.
    alpha
        Of the whole family.

    """
    order = np.argsort(p_values, kind="stable")
    levels = alpha / np.arange(len(p_values), 0, -1)
    kept = np.flatnonzero(p_values[order] > levels)
    if kept.size:
        levels[kept[0] :] = levels[kept[0]]
    out: Floats = np.empty(len(p_values))
    out[order] = levels
    return out
