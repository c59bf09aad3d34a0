"""How much the cells of each parallel scatter."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats
from burrscan.robust import SIGMA_PER_MEDIAN

_LEAST_CELLS = 20
"""Cells from which a row's own scatter is taken; a shorter row takes that of all."""
_CALMEST = 0.5
"""A row is not taken to be calmer than this share of the whole: its scatter is an estimate, too."""


def row_sigma(rest: Floats, *, least: float) -> Floats:
    """(rows,) robust standard deviation about 0 of (rows, columns) values, NaN where unknown."""
    size = np.abs(rest)
    count = np.isfinite(size).sum(axis=1)
    whole = float(np.nanmedian(size)) if count.any() else 0.0
    rows = [np.nanmedian(row) if n >= _LEAST_CELLS else whole for row, n in zip(size, count, strict=True)]
    return np.asarray(SIGMA_PER_MEDIAN * np.maximum(rows, max(_CALMEST * whole, least)))
