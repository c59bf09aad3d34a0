"""What the rows of a place agree on, column by column."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats


def column_medians(values: Floats) -> Floats:
    """(columns,) medians of the rows (rows, columns) that know a column; NaN where none does."""
    known = np.isfinite(values).any(axis=0)
    medians = np.full(values.shape[1], np.nan)
    medians[known] = np.nanmedian(values[:, known], axis=0)
    return medians


def measured_share(values: Floats) -> Floats:
    """(columns,) share of the rows (rows, columns) that know a column."""
    return np.asarray(np.isfinite(values).mean(axis=0))
