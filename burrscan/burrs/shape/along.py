"""How high a burr is along its length, and where it is highest."""

from __future__ import annotations

import numpy as np
from scipy.special import chdtri

from burrscan.arrays import Floats, Ints
from burrscan.burrs.shape.patch import Patch
from burrscan.burrs.shape.ridge import HUBER, Ridge, between, huber

_ALIKE = 0.01
"""Heights along a burr are alike unless chance gives such differences more rarely than this."""
_FEWEST = 3
"""Stretches from which their differences say anything."""


def height_of(patch: Patch, ridge: Ridge, *, least_mm: float) -> tuple[float, float]:
    """Largest height along the burr and its standard deviation.

    The burr is cut into stretches of at least ``least_mm``, each with a height of its own. Where these differ
    by less than noise makes them the common height is the answer: see :func:`largest`.
    """
    sigma = ridge.sigma_of([1, 0, 0, 0, 0])
    length = ridge.end_mm - ridge.start_mm
    count = int(np.clip(length / least_mm, 1, 24))
    if count < _FEWEST:
        return ridge.height_mm, sigma
    part = between(patch, (ridge.start_mm, ridge.end_mm))
    stretch = np.minimum((part.u_mm - ridge.start_mm) / length * count, count - 1).astype(np.int64)
    share, weight, misfit = _relative_heights(part, ridge, stretch, count)
    gain, gain_sigma = largest(share, weight / max(1.0, misfit))
    return ridge.height_mm * gain, float(np.hypot(sigma * gain, ridge.height_mm * gain_sigma))


def _relative_heights(patch: Patch, ridge: Ridge, stretch: Ints, count: int) -> tuple[Floats, Floats, float]:
    """Height of each stretch over the ridge's, its weight (none where it is not seen), and the misfit.

    The misfit is what is left when every stretch has its own height: differences along the burr, which are
    to be found, must not hide themselves.
    """
    model = ridge.height_mm * ridge.shape(patch)
    residual = np.abs(patch.lift_mm - model)
    w = np.minimum(1.0, HUBER * patch.sigma_mm / np.maximum(residual, 1e-300)) / patch.sigma_mm**2
    weight = np.bincount(stretch, weights=w * model**2, minlength=count).astype(np.float64)
    match = np.bincount(stretch, weights=w * model * patch.lift_mm, minlength=count)
    share = match / np.maximum(weight, 1e-300)
    left = np.abs(patch.lift_mm - share[stretch] * model) / patch.sigma_mm
    return share, weight, float(huber(left).sum()) / max(len(left) - count, 1)


def largest(share: Floats, weight: Floats, *, clear: bool = False) -> tuple[float, float]:
    """Largest of several heights, relative to the common one, and its sigma; (1, 0) where all are the same.

    Of the higher ones that are alike, at least half of them, or of all where no half is: the lower ones lie
    at corners of the part, or the burr is lower there. What noise does not explain of their differences is a
    random effect (spread by DerSimonian & Laird 1986), and the answer the largest of their posterior means.
    Where noise is more alike from one height to the next than ``weight`` knows, only ``clear`` differences
    count: what is alike is then one height.
    """
    known = weight > 0.2 * np.median(weight)
    order = np.argsort(-share[known], kind="stable")
    h, w = share[known][order], weight[known][order]
    if len(h) < _FEWEST:
        return 1.0, 0.0
    alike = False
    for count in range(len(h), max((len(h) - 1) // 2, 2), -1):
        if _common(h[:count], w[:count])[1] < chdtri(count - 1, _ALIKE):
            h, w, alike = h[:count], w[:count], True
            break
    mean, excess = _common(h, w)
    spread = (excess - len(h) + 1.0) / (w.sum() - w @ w / w.sum())
    if spread <= 0.0 or (alike and clear):
        if len(h) == len(share):
            return 1.0, 0.0
        return mean, float(np.sqrt(max(1.0 / w.sum() - 1.0 / weight.sum(), 0.0)))
    drawn = mean + (h - mean) * spread / (spread + 1.0 / w)
    highest = int(np.argmax(drawn))
    return float(drawn[highest]), float(np.sqrt(1.0 / (w[highest] + 1.0 / spread)))


def _common(height: Floats, weight: Floats) -> tuple[float, float]:
    """Weighted mean, and Cochran's Q of the differences from it."""
    mean = float(weight @ height / weight.sum())
    return mean, float(weight @ (height - mean) ** 2)
