"""How bright a cell should be, told by its parallel: one finish, one lobe, a smooth curve around the axis.

The logarithm of a lobe (Gaussian, Beckmann, the core of GGX) is a parabola in the angle near its top and
nearly straight on its flanks, so a parabola through what lies to both sides of a place predicts it, whatever
the finish.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from burrscan.arrays import Bools, Floats
from burrscan.burrs.light.row_sigma import row_sigma
from burrscan.robust import TUKEY, bisquare

_PASSES = 3
"""Fits of each parabola, each weighing by the misfit of the last: two settle what a burr beside it does."""
_LEAST_WEIGHT = 1e-3
"""Of a neighbour that misfits: on the top of a narrow highlight all do, and least squares fits them then."""
_LEAST_SHARE = 0.3
"""Share of the window that must be known: less is all on one side, and a parabola extrapolates badly."""
LEAST_SCATTER = 1e-6
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
        scatter = row_sigma(rest, least=LEAST_SCATTER)
        share = np.nan_to_num(rest / (TUKEY * scatter[:, None]), nan=1.0)
        weight = known * np.maximum(bisquare(share), _LEAST_WEIGHT)
    return rest, predicted, scatter


def _parabolas(values: Floats, weight: Floats, half: int, gap: int, least: float) -> Floats:
    """(rows, columns) value at every cell of a weighted parabola through its row's neighbours.

    By the normal equations, whose sums are correlations along the rows; NaN with too few neighbours.
    """
    x = np.arange(-half, half + 1) / half
    share = (1.0 - (x * half / (half + 1.0)) ** 2) * (np.abs(x) * half > gap)

    def summed(image: Floats, kernel: Floats) -> Floats:
        return np.asarray(ndimage.correlate1d(image, kernel, axis=1, mode="constant"))

    s0, s1, s2, s3, s4 = (summed(weight, share * x**power) for power in range(5))
    b0, b1, b2 = (summed(weight * values, share * x**power) for power in range(3))
    found = summed((weight > 0.0).astype(float), np.where(share > 0.0, 1.0, 0.0))
    # Cramer's rule for the constant term
    det = s0 * (s2 * s4 - s3 * s3) - s1 * (s1 * s4 - s2 * s3) + s2 * (s1 * s3 - s2 * s2)
    top = b0 * (s2 * s4 - s3 * s3) - s1 * (b1 * s4 - b2 * s3) + s2 * (b1 * s3 - b2 * s2)
    known = (found > least * 2 * (half - gap) - 0.5) & (det > 1e-9 * s0**3)
    return np.where(known, top / np.where(known, det, 1.0), np.nan)
