"""How bright a cell should be, told by its parallel: one finish, one lobe, a smooth curve around the axis.

The logarithm of a lobe (Gaussian, Beckmann, the core of GGX) is a parabola in the angle near its top and
nearly straight on its flanks, so a parabola through what lies to both sides of a place predicts it, whatever
the finish.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from burrscan.arrays import Bools, Floats
from burrscan.burrs.light.row_sigma import row_sigma
from burrscan.robust import TUKEY

_PASSES = 3
"""Fits of each parabola, each weighing by the misfit of the last: two settle what a burr beside it does."""
_LEAST_WEIGHT = 1e-3
"""Of a neighbour that misfits: on the top of a narrow highlight all do, and least squares fits them then."""
_LEAST_SHARE = 0.3
"""Share of the window that must be known: less is all on one side, and a parabola extrapolates badly."""
_LEAST_SCATTER = 1e-6
"""Of the logarithm of the light; less is the arithmetic's."""


def excess(brightness: Floats, known: Bools, *, half: int, gap: int) -> tuple[Floats, Floats, Floats]:
    """Brightness less what the parallel predicts.

    Parameters
    ----------
    brightness
        (rows, columns) logarithm of the light.
    known
        True where it is to be believed.
    half, gap
        Columns to each side that predict a cell, without the nearest ``gap``.

    Returns
    -------
    tuple
        (rows, columns) excess, NaN where there is no prediction; (rows, columns) the prediction; (rows,)
        robust standard deviation of the excess. O(cells · half).

    """
    weight = known.astype(float)
    scatter = np.full(len(brightness), np.inf)
    values = np.where(known, brightness, 0.0)
    for _ in range(_PASSES):
        predicted = _parabolas(values, weight, half, gap, _LEAST_SHARE)
        rest = np.where(known, brightness - predicted, np.nan)
        scatter = row_sigma(rest, least=_LEAST_SCATTER)
        share = np.nan_to_num(rest / (TUKEY * scatter[:, None]), nan=1.0)
        weight = known * np.maximum((1.0 - np.minimum(share**2, 1.0)) ** 2, _LEAST_WEIGHT)
    return rest, predicted, scatter


@njit(cache=True, parallel=True, nogil=True)
def _parabolas(values: Floats, weight: Floats, half: int, gap: int, least: float) -> Floats:
    """The value at every cell of a weighted parabola through its row's neighbours; NaN with too few."""
    rows, columns = values.shape
    out = np.full((rows, columns), np.nan)
    for i in prange(rows):
        for j in range(columns):
            out[i, j] = _parabola(values[i], weight[i], j, half, gap, least)
    return out


@njit(cache=True, nogil=True)
def _parabola(values: Floats, weight: Floats, j: int, half: int, gap: int, least: float) -> float:
    """The value at one cell of its row's parabola, by the normal equations."""
    s0, s1, s2, s3, s4, b0, b1, b2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    found = 0
    for k in range(-half, half + 1):
        if abs(k) <= gap or not 0 <= j + k < values.size or weight[j + k] == 0.0:
            continue
        found += 1
        x = k / half
        w = weight[j + k] * (1.0 - (k / (half + 1.0)) ** 2)
        y = values[j + k]
        s0 += w
        s1 += w * x
        s2 += w * x * x
        s3 += w * x * x * x
        s4 += w * x * x * x * x
        b0 += w * y
        b1 += w * x * y
        b2 += w * x * x * y
    if found < least * 2 * (half - gap):
        return np.nan
    # Cramer's rule for the constant term
    det = s0 * (s2 * s4 - s3 * s3) - s1 * (s1 * s4 - s2 * s3) + s2 * (s1 * s3 - s2 * s2)
    top = b0 * (s2 * s4 - s3 * s3) - s1 * (b1 * s4 - b2 * s3) + s2 * (b1 * s3 - b2 * s2)
    return top / det if det > 1e-9 * s0**3 else np.nan
