"""What the rows of a place agree on, column by column."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats

_SEEN = 0.2
"""Share of a column with a depth from which that depth counts."""


def column_medians(values: Floats) -> Floats:
    """(columns,) medians of the rows (rows, columns) that know a column; NaN where none does."""
    known = np.isfinite(values).any(axis=0)
    medians = np.full(values.shape[1], np.nan)
    medians[known] = np.nanmedian(values[:, known], axis=0)
    return medians


def measured_share(values: Floats) -> Floats:
    """(columns,) share of the rows (rows, columns) that know a column; 0 where too few do to count."""
    share = np.isfinite(values).mean(axis=0)
    return np.where(share > _SEEN, share, 0.0)
