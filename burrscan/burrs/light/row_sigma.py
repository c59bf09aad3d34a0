"""How much the cells of each parallel scatter, and those that are looked at flatly, or are dark."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats
from burrscan.robust import SIGMA_PER_MEDIAN

_LEAST_CELLS = 20
"""Cells from which a row's own scatter is taken; a shorter row takes that of all."""
_CALMEST = 0.5
"""No row and no slope is taken to be calmer than this share of the whole: its scatter is an estimate."""
_STEPS = 10
"""From 0 to 1 that are told apart; between them what a cell errs by changes evenly."""
_PASSES = 2
"""Of rows and steps in turn: the second tells what rows differ by without their steps."""


def row_sigma(rest: Floats, *, least: float) -> Floats:
    """(rows,) robust standard deviation about 0 of (rows, columns) values, NaN where unknown."""
    size = np.sort(np.abs(rest), axis=1)  # what is unknown comes last
    known = np.isfinite(size)
    if not known.any():
        return np.full(len(size), SIGMA_PER_MEDIAN * least)
    whole, count, row = float(np.median(size[known])), known.sum(axis=1), np.arange(len(size))
    median = 0.5 * (size[row, np.maximum(count - 1, 0) // 2] + size[row, count // 2])
    rows = np.where(count >= _LEAST_CELLS, median, whole)
    return np.asarray(SIGMA_PER_MEDIAN * np.maximum(rows, max(_CALMEST * whole, least)))


def cell_sigma(rest: Floats, by: Floats, *, least: float) -> Floats:
    """(rows, columns) robust standard deviation about 0 of (rows, columns) values, NaN where unknown.

    It is that of the row times that of what else it goes ``by`` on whatever row, (rows, columns) from 0 to 1:
    the cosine at which a cell is looked at, for what is looked at flatly is darker and errs by more, or how
    bright it should be. O(cells).
    """
    step = np.minimum(np.floor(_STEPS * by).astype(np.int64), _STEPS - 1)
    alike = [np.isfinite(rest) & (step == number) for number in range(_STEPS)]
    told = [number for number, each in enumerate(alike) if np.count_nonzero(each) >= _LEAST_CELLS]
    times = np.ones(rest.shape)
    for _ in range(_PASSES):
        rows = row_sigma(rest / times, least=least)[:, None]
        if told:
            size = np.abs(rest) / rows
            usual = [SIGMA_PER_MEDIAN * float(np.median(size[alike[number]])) for number in told]
            times = np.interp(by, (np.array(told) + 0.5) / _STEPS, np.maximum(usual, _CALMEST))
    return np.maximum(rows * times, SIGMA_PER_MEDIAN * least)
