"""How sure the curve is, and how thick the band of data around it."""

from __future__ import annotations

import numpy as np
from numba import njit

from burrscan.arrays import Floats, Ints, Ints32
from burrscan.generatrix.polyline import Foot, Polyline
from burrscan.generatrix.refine import Step
from burrscan.generatrix.tracing.cells import along_arc

_SECTORS = 16
"""Of the arc: their scatter has 15 degrees of freedom, and each still averages over what neighbours share."""


def sigma_mm(fit: Step, foot: Foot, angle: Floats, arc: tuple[float, float], stated_mm: float) -> Floats:
    """(K,) standard deviation of the curve along its normal.

    The larger of two: what independent noise leaves, and what the disagreement between sectors of the arc
    shows (correlated noise, an axis slightly off). O(V + K).
    """
    weight = np.maximum(fit.weight, 1.0)
    independent = np.maximum(fit.scale_mm, stated_mm) / np.sqrt(weight)
    count, total = _sector_sums(
        foot.segment, foot.t, foot.distance_mm, angle, arc, fit.line.starts, fit.scale_mm
    )
    return np.maximum(independent, _between(count, total))


def _between(count: Floats, total: Floats) -> Floats:
    """Standard error of the mean of all sectors from their scatter, pooled over five nodes."""
    nodes = np.maximum(count.sum(axis=1, keepdims=True), 1.0)
    mean = total.sum(axis=1, keepdims=True) / nodes
    scatter = ((total - count * mean) ** 2).sum(axis=1) / nodes[:, 0] ** 2
    used = (count > 0.0).sum(axis=1)
    scatter *= used / np.maximum(used - 1, 1)
    return np.sqrt(_five(scatter) / _five(np.ones(len(scatter))))


def _five(values: Floats) -> Floats:
    """(K,) sum of each value and its two neighbours on either side, however few there are."""
    return np.convolve(values, np.ones(5), mode="full")[2 : 2 + len(values)]


@njit(cache=True, nogil=True, error_model="numpy")
def _sector_sums(
    segment: Ints32,
    t: Floats,
    distance: Floats,
    angle: Floats,
    arc: tuple[float, float],
    starts: Ints,
    scale: Floats,
) -> tuple[Floats, Floats]:
    count, total = np.zeros((len(scale), _SECTORS)), np.zeros((len(scale), _SECTORS))
    for i in range(len(segment)):
        if segment[i] < 0:
            continue
        node = starts[segment[i]] + (1 if t[i] > 0.5 else 0)
        if abs(distance[i]) < 4.0 * scale[node]:
            sector = min(int(along_arc(angle[i], arc) * _SECTORS), _SECTORS - 1)
            count[node, sector] += 1.0
            total[node, sector] += distance[i]
    return count, total


def band_mm(line: Polyline, foot: Foot) -> Floats:
    """(K,) span between the largest deviations inwards and outwards (seed paper, section 5.2). O(V + K)."""
    low, high = _extremes(foot.segment, foot.t, foot.distance_mm, line.starts, len(line.nodes_mm))
    return np.where(high >= low, high - low, np.nan)


@njit(cache=True, nogil=True, error_model="numpy")
def _extremes(
    segment: Ints32, t: Floats, distance: Floats, starts: Ints, nodes: int
) -> tuple[Floats, Floats]:
    low, high = np.full(nodes, np.inf), np.full(nodes, -np.inf)
    for i in range(len(segment)):
        if segment[i] >= 0:
            node = starts[segment[i]] + (1 if t[i] > 0.5 else 0)
            low[node], high[node] = min(low[node], distance[i]), max(high[node], distance[i])
    return low, high
