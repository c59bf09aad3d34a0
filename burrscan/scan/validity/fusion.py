"""What two rounds know together: which columns to believe, and their mean."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from burrscan.arrays import Bools, Floats32
from burrscan.correspondence import Correspondence
from burrscan.scan.matching.matched import Reading
from burrscan.scan.validity.consistency import consistent
from burrscan.scan.validity.region_growing import grow_regions

_DIRECT_DOMINATES = 0.5
"""Interreflected over direct light: from there on the brightest path may not be the direct one."""
_APART_Z = 6.0
"""In sigma: two rounds farther apart saw different things; noise does that in 2e-9 of the pixels."""


class Mean(NamedTuple):
    """Columns of both rounds weighed by their information, and where the rounds agree; all (h, w)."""

    u_px: Floats32
    sigma_px: Floats32
    lost: Floats32
    misfit: Floats32
    agree: Bools


def mean_of(crude: Reading, final: Reading) -> Mean:
    """Weigh the rounds by their information."""
    u = np.stack([crude.u_px, final.u_px])
    information = np.nan_to_num(1.0 / np.stack([crude.sigma_u_px, final.sigma_u_px]) ** 2)
    total = information.sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = (np.nan_to_num(u) * information).sum(axis=0) / total
        sigma = 1.0 / np.sqrt(total)
        apart = np.abs(u[0] - u[1]) / np.hypot(crude.sigma_u_px, final.sigma_u_px)
    last = information[1] > 0.0
    lost, misfit = np.where(last, final.lost, crude.lost), np.where(last, final.misfit, crude.misfit)
    return Mean(mean, sigma, lost, misfit, ~(apart > _APART_Z))


def believed(crude: Reading, final: Reading, *, max_sigma_px: float) -> tuple[Bools, Bools]:
    """Which pixels (h, w) of each round to believe.

    Sure are columns far ahead of all others on which the rounds agree, where direct light dominates; believed
    is what continues them. Of the rest each round offers its best column, the final one's coming first.
    """
    clear = mean_of(crude.blanked(max_sigma_px=max_sigma_px), final.blanked(max_sigma_px=max_sigma_px))
    with np.errstate(invalid="ignore"):
        sure = clear.agree & (clear.lost < _DIRECT_DOMINATES)
    weak = [one.blanked(max_sigma_px=max_sigma_px, least_lead=0.0) for one in (final, crude)]
    u, sigma = np.where(clear.agree, clear.u_px, np.float32(np.nan)), clear.sigma_px
    for one in weak:
        sigma = np.where(np.isfinite(u), sigma, one.sigma_u_px)
        u = np.where(np.isfinite(u), u, one.u_px)
    surface = grow_regions(u, sigma, sure & np.isfinite(u))
    with np.errstate(invalid="ignore"):
        last, first = (surface & (np.abs(one.u_px - u) <= _APART_Z * one.sigma_u_px) for one in weak)
    return first, last


def fuse(crude: Reading, final: Reading, *, width: int, max_sigma_px: float) -> Correspondence:
    """The mean of two settled rounds; where they contradict each other neither is believed."""
    mean = mean_of(crude, final)
    with np.errstate(invalid="ignore"):
        mask = mean.agree & (mean.sigma_px <= max_sigma_px)
        mask &= (mean.u_px > -0.5) & (mean.u_px < width - 0.5)
    mask &= consistent(_masked(mean.u_px, mask), _masked(mean.sigma_px, mask), mean.lost, mean.misfit)
    return Correspondence(_masked(mean.u_px, mask), _masked(mean.sigma_px, mask), mask)


def _masked(values: Floats32, mask: Bools) -> Floats32:
    return np.where(mask, values, np.nan).astype(np.float32)
