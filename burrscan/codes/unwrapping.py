"""Unwrapping in time: each phase tells the stripe of the next finer one (Huntley & Saldner 1993)."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from burrscan.arrays import Bools, Floats
from burrscan.codes.phase import Phase
from burrscan.correspondence import Correspondence


def climb(
    phases: tuple[Phase, ...],
    u_px: Floats,
    doubtful: Bools,
    *,
    width: int,
    max_sigma_px: float = 0.4,
    z: float = 4.0,
) -> Correspondence:
    """From columns by the longest period, and where those are doubtful, up to the finest period's."""
    for coarse, fine in pairwise(phases):
        u_px, moved = refine(u_px, fine)
        noise = np.hypot(coarse.sigma_px, fine.sigma_px)
        doubtful |= (z * noise > 0.5 * fine.period_px) | (moved > z * noise + 0.05 * fine.period_px)
    return accept(u_px, phases[-1], doubtful, phases, width=width, max_sigma_px=max_sigma_px)


def refine(u_px: Floats, phase: Phase) -> tuple[Floats, Floats]:
    """The column with this phase nearest to ``u_px``, and how far that is."""
    moved = (phase.offset_px - u_px + 0.5 * phase.period_px) % phase.period_px - 0.5 * phase.period_px
    return u_px + moved, np.abs(moved)


def accept(
    u_px: Floats,
    finest: Phase,
    doubtful: Bools,
    phases: tuple[Phase, ...],
    *,
    width: int,
    max_sigma_px: float,
) -> Correspondence:
    """A correspondence with the finest phase's sigma; clipped, coarse, doubtful, outside is masked."""
    mask = ~doubtful & (finest.sigma_px <= max_sigma_px) & (u_px > -0.5) & (u_px < width - 0.5)
    for phase in phases:
        mask &= ~phase.clipped
    nan = np.float32(np.nan)
    return Correspondence(
        np.where(mask, u_px, nan).astype(np.float32), np.where(mask, finest.sigma_px, nan), mask
    )
