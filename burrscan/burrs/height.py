"""A burr whose height turns out to be another: what follows from it follows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from burrscan.inspection import Burr, Value


def with_height(burr: Burr, height: Value, *, share: float) -> Burr:
    """The burr of another height, mm; its area and its volume grow with it.

    Parameters
    ----------
    burr
        With a height above 0.
    height
        Its value and standard deviation.
    share
        The part of the height's uncertainty that area and volume did not have, as a share of the height.

    """
    by = height.value / burr.height_mm.value

    def grown(value: Value) -> Value:
        return Value(value.value * by, float(np.hypot(value.sigma * by, value.value * by * share)))

    return replace(burr, height_mm=height, area_mm2=grown(burr.area_mm2), volume_mm3=grown(burr.volume_mm3))


def volume(area: Value, length: Value) -> Value:
    """Of a burr of that cross-section and length, mm³."""
    sigma = float(np.hypot(area.sigma * length.value, area.value * length.sigma))
    return Value(area.value * length.value, sigma)


def combined(one: Value, other: Value) -> Value:
    """Mean of two that have nothing in common, by their variances; surer than both only where they agree."""
    weights = np.array([one.sigma, other.sigma]) ** -2.0
    each = np.array([one.value, other.value])
    mean = float(weights @ each / weights.sum())
    between = float(weights @ (each - mean) ** 2 / weights.sum())
    return Value(mean, float(np.sqrt(1.0 / weights.sum() + between)))


def judged(burr: Burr, limit_mm: float | None) -> Burr:
    """The burr with its verdict against the size limit; none without a limit, or without a height.

    The last step of a burr method: before it the height may still change.
    """
    if limit_mm is None or np.isnan(burr.height_mm.value):
        return replace(burr, within_limit=None)
    return replace(burr, within_limit=bool(burr.height_mm.value <= limit_mm))
