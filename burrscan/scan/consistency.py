"""Pixels judged by their neighbours: torn footprints at depth edges, and lone outliers.

A pixel whose footprint straddles a depth edge mixes two columns. It gives itself away: beside it the columns
jump, and its stripes have lost modulation that full light still shows.
"""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Bools, Floats32

_STEPS = ((0, 1), (0, -1), (1, 0), (-1, 0))


def consistent(
    u_px: Floats32,
    sigma_px: Floats32,
    lost: Floats32,
    *,
    jump_px: float = 2.5,
    most_lost: float = 0.12,
    outlier_z: float = 5.0,
    outlier_px: float = 0.5,
) -> Bools:
    """Which pixels agree with their surroundings.

    Parameters
    ----------
    u_px, sigma_px
        (h, w) columns and stated sigmas, NaN where unknown.
    lost
        (h, w) light that full light shows beyond the stripes' modulation, per modulated light.
    jump_px
        More than this between neighbours (and twice that at two pixels' distance) is an edge.
    most_lost
        Beside an edge a pixel may have lost no more than this above the least of its surroundings.
    outlier_z, outlier_px
        A pixel off the middle of both its left and right and its upper and lower neighbours by more than
        ``outlier_px`` plus so many sigmas is an outlier, as is one with fewer than two direct neighbours.

    Notes
    -----
    O(pixels). The thresholds are in projector pixels, the unit in which a footprint is compact.

    """
    beside_edge = np.zeros(u_px.shape, bool)
    for step in _STEPS:
        for distance in (1, 2):
            there = shifted(u_px, step[0] * distance, step[1] * distance)
            with np.errstate(invalid="ignore"):
                beside_edge |= np.abs(there - u_px) > distance * jump_px
    around = np.fmin.reduce([shifted(lost, 2 * y, 2 * x) for y, x in _STEPS])
    torn = beside_edge & (lost - around > most_lost)
    good: Bools = np.isfinite(u_px) & ~torn & ~_outlying(u_px, sigma_px, outlier_z, outlier_px)
    return good


def shifted(image: Floats32, rows: int, columns: int) -> Floats32:
    """The image as seen from (rows, columns) further on; NaN beyond the border."""
    height, width = image.shape
    moved = np.full_like(image, np.nan)
    y, x = max(rows, 0), max(columns, 0)
    cut = image[y : height + min(rows, 0), x : width + min(columns, 0)]
    moved[max(-rows, 0) : height - y, max(-columns, 0) : width - x] = cut
    return moved


def _outlying(u_px: Floats32, sigma_px: Floats32, z: float, least_px: float) -> Bools:
    left, right, down, up = (shifted(u_px, *step) for step in ((0, -1), (0, 1), (1, 0), (-1, 0)))
    neighbours = sum(np.isfinite(n).astype(np.int8) for n in (left, right, down, up))
    across, along = np.abs(0.5 * (left + right) - u_px), np.abs(0.5 * (up + down) - u_px)
    nearest = np.fmin(across, along)
    with np.errstate(invalid="ignore"):
        off = nearest > least_px + z * sigma_px
    outlying: Bools = off | (neighbours < 2)
    return outlying
