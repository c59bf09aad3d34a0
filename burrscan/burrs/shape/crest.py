"""How high a burr on an edge is: as high as its vertices reach.

Beyond an edge all vertices have the edge as their nearest place. On the unrolled surface a burr's flank there
is a wall without width, of which a ridge would take the middle. But one sees a flank up to the crest.
"""

from __future__ import annotations

import numpy as np
from scipy.special import chdtri

from burrscan.arrays import Floats, Ints
from burrscan.burrs.shape.patch import Patch
from burrscan.burrs.shape.ridge import between
from burrscan.inspection import Value
from burrscan.robust import MEDIAN_OVER_MEAN, SIGMA_PER_MEDIAN

_FEWEST = 3
"""Slices of a burr, and stretches: the scatter of fewer tells nothing."""
_ALIKE = 0.01
"""Heights along a burr are alike unless chance gives such differences more rarely than this."""
_MOST_OF_A_TIP = 0.5
"""Share of its height that a mean over a base's own width takes off a triangle."""
_ON_FLANK = 2.0
"""In sigma: what is lower is on the surface, and does not tell how far apart vertices on the flank are."""


def crest_of(
    patch: Patch, extent: tuple[float, float], *, spacing_mm: float, least_mm: float
) -> Value | None:
    """Largest height along the burr; None from too few vertices. O(N log N).

    Of vertices evenly spread up a flank the highest is half of their distance below its crest, on average. So
    much is added in every slice, one vertex wide. By how much it is off is not averaged away: rows of a scan
    run along an edge. Where stretches of ``least_mm`` differ by more than their slices do, the burr's height
    varies.

    Parameters
    ----------
    patch
        The vertices of the burr.
    extent
        Where it begins and ends along u, mm.
    spacing_mm
        Distance between neighbouring vertices.
    least_mm
        Least length over which a height is stated.

    """
    length = extent[1] - extent[0]
    slices = max(int(length / spacing_mm), 1)
    part = between(patch, extent)
    high = part.lift_mm > _ON_FLANK * part.sigma_mm
    place = np.minimum((part.u_mm[high] - extent[0]) / length * slices, slices - 1).astype(np.int64)
    count, top = np.bincount(place, minlength=slices), np.zeros(slices)
    np.maximum.at(top, place, part.lift_mm[high])
    seen = np.flatnonzero(count)
    if len(seen) < _FEWEST:
        return None
    missed = 0.5 * top[seen] / count[seen]
    stretches = max(int(length / least_mm), 1)
    height, weight = _stretches(top[seen] + missed, seen * stretches // slices, stretches)
    common = float(weight @ height / weight.sum())
    gain, gain_sigma = _largest(height / common, weight * common**2)
    noise = np.hypot(1.0 / np.sqrt(weight.sum()), common * gain_sigma)
    row = 2.0 * float(np.median(missed)) / np.sqrt(12.0)  # evenly within the distance between two rows
    return Value(common * gain, float(np.hypot(noise, row)))


def with_tip(crest: Value, *, width_mm: float, footprint_mm: float) -> Value:
    """The height of a crest that pixels look down on, each as wide as ``footprint_mm`` across the burr.

    The mean over a triangle's tip is lower by height · footprint / (2 · base width), that over a blunt one by
    less: half of it is added, and none is as likely as all. The tip of a base narrower than a pixel is never
    more than as much again. From aside nothing is averaged: ``footprint_mm`` is 0.
    """
    share = min(footprint_mm / (2.0 * width_mm), _MOST_OF_A_TIP)
    missed = crest.value * share / (1.0 - share)
    return Value(crest.value + 0.5 * missed, float(np.hypot(crest.sigma, missed / np.sqrt(12.0))))


def _stretches(height: Floats, stretch: Ints, count: int) -> tuple[Floats, Floats]:
    """Median height of each stretch and its weight, 1/mm²; no weight where nothing is seen of it."""
    middle, number = np.zeros(count), np.bincount(stretch, minlength=count)
    for one in np.flatnonzero(number):
        middle[one] = np.median(height[stretch == one])
    scatter = SIGMA_PER_MEDIAN * float(np.median(np.abs(height - middle[stretch])))
    return middle, number / max(MEDIAN_OVER_MEAN * scatter, 1e-9) ** 2


def _largest(share: Floats, weight: Floats) -> tuple[float, float]:
    """Largest of several heights, relative to the common one, and its sigma; (1, 0) where all are the same.

    Of the higher ones that are alike, at least half of them, or of all where no half is: the lower ones lie
    at corners of the part, or the burr is lower there. Rows are shared by slices, so noise is more alike from
    one height to the next than ``weight`` knows: what is alike is one height, and only clear differences
    count. Of these what noise does not explain is a random effect (spread by DerSimonian & Laird 1986), and
    the answer the largest of their posterior means.
    """
    known = weight > 0.2 * np.median(weight)
    order = np.argsort(-share[known], kind="stable")
    h, w = share[known][order], weight[known][order]
    if len(h) < _FEWEST:
        return 1.0, 0.0
    for count in range(len(h), max((len(h) - 1) // 2, 2), -1):
        mean, excess = _common(h[:count], w[:count])
        if excess < chdtri(count - 1, _ALIKE):
            if count == len(share):
                return 1.0, 0.0
            return mean, float(np.sqrt(max(1.0 / w[:count].sum() - 1.0 / weight.sum(), 0.0)))
    mean, excess = _common(h, w)
    spread = (excess - len(h) + 1.0) / (w.sum() - w @ w / w.sum())
    drawn = mean + (h - mean) * spread / (spread + 1.0 / w)
    highest = int(np.argmax(drawn))
    return float(drawn[highest]), float(np.sqrt(1.0 / (w[highest] + 1.0 / spread)))


def _common(height: Floats, weight: Floats) -> tuple[float, float]:
    """Weighted mean, and Cochran's Q of the differences from it."""
    mean = float(weight @ height / weight.sum())
    return mean, float(weight @ (height - mean) ** 2)
