"""Pixels judged by their neighbours: lone outliers are dropped."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Bools, Floats32


def consistent(
    u_px: Floats32, sigma_px: Floats32, *, outlier_z: float = 5.0, outlier_px: float = 0.5
) -> Bools:
    """Which pixels agree with their surroundings.

    Parameters
    ----------
    u_px, sigma_px
        (h, w) columns and stated sigmas, NaN where unknown.
    outlier_z, outlier_px
        A pixel off the middle of both its left and right and its upper and lower neighbours by more than
        ``outlier_px`` plus so many sigmas is an outlier, as is one with fewer than two direct neighbours.

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
    good: Bools = np.isfinite(u_px) & ~off & (neighbours >= 2)
    return good


def shifted(image: Floats32, rows: int, columns: int) -> Floats32:
    """The image as seen from (rows, columns) further on; NaN beyond the border."""
    height, width = image.shape
    moved = np.full_like(image, np.nan)
    y, x = max(rows, 0), max(columns, 0)
    cut = image[y : height + min(rows, 0), x : width + min(columns, 0)]
    moved[max(-rows, 0) : height - y, max(-columns, 0) : width - x] = cut
    return moved
