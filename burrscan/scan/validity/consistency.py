"""Pixels judged by their neighbours: lone outliers, and mixed pixels at the border of the known."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Bools, Floats32
from burrscan.shifted import shifted

_FITTING = 3.0
"""Chi² per degree of freedom below which phasors fit one column, so that a loss of modulation is a
mixture's."""


def consistent(
    u_px: Floats32,
    sigma_px: Floats32,
    lost: Floats32,
    misfit: Floats32,
    *,
    outlier_z: float = 5.0,
    outlier_px: float = 0.5,
    most_lost: float = 0.25,
) -> Bools:
    """Which pixels agree with their surroundings.

    Parameters
    ----------
    u_px, sigma_px
        (h, w) columns and stated sigmas, NaN where unknown.
    lost
        (h, w) light that full light shows beyond the stripes' modulation, per modulated light.
    misfit
        (h, w) chi² per degree of freedom of the pixel's phasors.
    outlier_z, outlier_px
        A pixel off the middle of both its left and right and its upper and lower neighbours by more than
        ``outlier_px`` plus so many sigmas is an outlier, as is one with fewer than two direct neighbours.
    most_lost
        Beside pixels without a column a pixel may have lost no more than this above the least of its
        surroundings, unless its misfit shows where that light comes from: else the footprint holds a part
        of a surface that nobody measured.

    Notes
    -----
    O(pixels). The threshold is in projector pixels, the unit in which a footprint is compact.

    """
    left, right = shifted(u_px, 0, -1), shifted(u_px, 0, 1)
    down, up = shifted(u_px, 1, 0), shifted(u_px, -1, 0)
    neighbours = np.isfinite(np.stack([left, right, down, up])).sum(axis=0)
    nearest = np.fmin(np.abs(0.5 * (left + right) - u_px), np.abs(0.5 * (up + down) - u_px))
    with np.errstate(invalid="ignore"):
        off = nearest > outlier_px + outlier_z * sigma_px
    mixed = (neighbours < 4) & (misfit < _FITTING) & (lost - _least_around(lost, u_px) > most_lost)
    good: Bools = np.isfinite(u_px) & ~off & ~mixed & (neighbours >= 2)
    return good


def _least_around(lost: Floats32, u_px: Floats32) -> Floats32:
    """The least loss among the known pixels two steps away, 0 where there is none."""
    known = np.where(np.isfinite(u_px), lost, np.float32(np.nan))
    around = [shifted(known, 2 * rows, 2 * columns) for rows, columns in ((0, 1), (0, -1), (1, 0), (-1, 0))]
    least: Floats32 = np.nan_to_num(np.fmin.reduce(around))
    return least
