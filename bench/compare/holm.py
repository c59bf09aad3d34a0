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
