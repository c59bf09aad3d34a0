"""How sure the curve is, and how thick the band of data around it."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats, Ints
from burrscan.generatrix.polyline import Foot, Polyline
from burrscan.generatrix.refine import Step
from burrscan.generatrix.tracing.cells import past_start

_SECTORS = 16
"""Of the arc: their scatter has 15 degrees of freedom, and each still averages over what neighbours share."""


def sigma_mm(fit: Step, foot: Foot, angle: Floats, arc: tuple[float, float], stated_mm: float) -> Floats:
    """(K,) standard deviation of the curve along its normal.

    The larger of two: what independent noise leaves, and what the disagreement between sectors of the arc
    shows (correlated noise, an axis slightly off). O(V + K).
    """
    weight = np.maximum(fit.weight, 1.0)
    independent = np.maximum(fit.scale_mm, stated_mm) / np.sqrt(weight)
    count, total = _sector_sums(fit.line, foot, angle, arc, fit.scale_mm)
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


def _sector_sums(
    line: Polyline, foot: Foot, angle: Floats, arc: tuple[float, float], scale: Floats
) -> tuple[Floats, Floats]:
    """(K, sectors) how many points are near a node in a sector, and the sum of their distances."""
    node, distance = _nearest_nodes(foot, line), foot.distance_mm[foot.valid]
    share = past_start(angle[foot.valid], arc) / arc[1]
    sector = np.minimum((share * _SECTORS).astype(int), _SECTORS - 1)
    near = np.abs(distance) < 4.0 * scale[node]
    cell, shape = (node * _SECTORS + sector)[near], (len(scale), _SECTORS)
    size = len(scale) * _SECTORS
    count = np.asarray(np.bincount(cell, minlength=size), np.float64)
    total = np.asarray(np.bincount(cell, distance[near], size), np.float64)
    return count.reshape(shape), total.reshape(shape)


def band_mm(line: Polyline, foot: Foot) -> Floats:
    """(K,) span between the largest deviations inwards and outwards (seed paper, section 5.2). O(V + K)."""
    low, high = np.full(len(line.nodes_mm), np.inf), np.full(len(line.nodes_mm), -np.inf)
    node, distance = _nearest_nodes(foot, line), foot.distance_mm[foot.valid]
    np.minimum.at(low, node, distance)
    np.maximum.at(high, node, distance)
    return np.where(high >= low, high - low, np.nan)


def _nearest_nodes(foot: Foot, line: Polyline) -> Ints:
    """(N,) node that each point with a foot is nearest to."""
    found = foot.valid
    return line.starts[foot.segment[found]] + (foot.t[found] > 0.5)
