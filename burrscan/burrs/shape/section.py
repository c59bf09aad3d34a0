"""Cross-sections of a ridge: triangle, blunt triangle, parabola, and what a pixel's footprint makes of them.

A pixel sees the mean over its footprint, as wide as the distance to the next. So what a scanner gives of a
crest is the triangle's running mean, lower by height · footprint / (2 · base width).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from burrscan.arrays import Floats

WHOLE = (-np.inf, np.inf)
"""No part of a cross-section is hidden."""


class Kind(NamedTuple):
    """What sort of cross-section a ridge has.

    ``power``: 1 for the triangle, 2 for the parabola. ``footprint_mm``: over what width the triangle is
    averaged, 0 where vertices are points; the parabola is not. ``blunt``: share of the triangle's base by
    which its top is flat, below 1; the parabola has none.
    """

    power: int = 1
    footprint_mm: float = 0.0
    blunt: float = 0.0


def section(
    x: Floats, left: float, right: float, kind: Kind, *, seen: tuple[float, float] = WHOLE
) -> tuple[Floats, Floats, Floats, Floats]:
    """(N,) heights of a unit cross-section, and their derivatives with x, the left and the right half-width.

    Parameters
    ----------
    x
        (N,) places across, from the crest, mm.
    left, right
        Half-widths of the base, mm.
    kind
        Which.
    seen
        From where to where it is, mm from the crest: beyond it there is nothing. For what is averaged only.

    """
    power, footprint, blunt = kind
    if blunt > 0.0:  # a triangle less the smaller one that its tip was
        sharp = kind._replace(blunt=0.0)
        whole = section(x, left, right, sharp, seen=seen)
        tip = section(x, blunt * left, blunt * right, sharp, seen=seen)
        shares = blunt, blunt, blunt**2, blunt**2
        height, by_x, by_left, by_right = (
            (a - share * b) / (1.0 - blunt) for a, b, share in zip(whole, tip, shares, strict=True)
        )
        return height, by_x, by_left, by_right
    if footprint > 0.0:
        below = _below if power == 1 else _below_parabola
        start, end = (below(x + way * footprint, left, right, seen) for way in (-0.5, 0.5))
        area, by_left, by_right, height = ((b - a) / footprint for a, b in zip(start, end, strict=True))
        return area, height, by_left, by_right
    sense = np.where(x >= 0.0, 1.0, -1.0)
    half = np.where(x >= 0.0, right, left)
    q = np.minimum(np.abs(x) / half, 1.0)
    slope = (q < 1.0) * power * q ** (power - 1)
    by_half = slope * q / half
    return 1.0 - q**power, -slope * sense / half, by_half * (sense < 0.0), by_half * (sense > 0.0)


def _below(
    x: Floats, left: float, right: float, seen: tuple[float, float]
) -> tuple[Floats, Floats, Floats, Floats]:
    """(N,) areas of a unit triangle up to x, derivatives with both half-widths, and the triangle's height."""
    inside = (x >= seen[0]) & (x <= seen[1])
    x = np.clip(x, *seen)
    rise, fall = np.clip(1.0 + x / left, 0.0, 1.0), np.clip(1.0 - x / right, 0.0, 1.0)
    before = x < 0.0
    area = np.where(before, 0.5 * left * rise**2, 0.5 * left + 0.5 * right * (1.0 - fall**2))
    by_left = np.where(before, 0.5 * rise**2 - rise * x / left, 0.5)
    by_right = np.where(before, 0.0, 0.5 * (1.0 - fall**2) - fall * x / right)
    return area, by_left, by_right, np.where(before, rise, fall) * inside


def _below_parabola(
    x: Floats, left: float, right: float, seen: tuple[float, float]
) -> tuple[Floats, Floats, Floats, Floats]:
    """The same of a unit parabola."""
    inside = (x >= seen[0]) & (x <= seen[1])
    x = np.clip(x, *seen)
    before = x < 0.0
    q = np.clip(x / np.where(before, left, right), -1.0, 1.0)
    area = 2.0 / 3.0 * left + np.where(before, left, right) * (q - q**3 / 3.0)
    by_left = 2.0 / 3.0 * np.where(before, 1.0 + q**3, 1.0)
    by_right = np.where(before, 0.0, 2.0 / 3.0 * q**3)
    return area, by_left, by_right, (1.0 - q * q) * inside
