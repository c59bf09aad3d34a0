"""Robust least squares of a polyline in the (z, r) plane: nodes move along their normals.

Each point's signed normal distance depends linearly on the offsets of the two nodes of its segment, so that
every step solves one tridiagonal system per piece. Weights are Tukey's, with a scale per node.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from burrscan.arrays import Floats, Ints, Ints32
from burrscan.generatrix.polyline import Foot, Polyline
from burrscan.robust import TUKEY

_STIFFNESS = 0.05
"""How strongly a node without data follows its neighbours, relative to the mean weight of a node."""
_ALIKE = 0.9
"""Cosine of the largest turn within a smooth stretch of curve."""


@dataclass(frozen=True)
class Step:
    """One step of the fit.

    Parameters
    ----------
    line
        The polyline after the step.
    weight
        (K,) sum of weights at each node: how well it is determined.
    scale_mm
        (K,) robust standard deviation of the data along the normal.

    """

    line: Polyline
    weight: Floats
    scale_mm: Floats


def step(
    line: Polyline, foot: Foot, *, scale_mm: Floats, tangents: Floats, count: Floats | None = None
) -> Step:
    """One Gauss-Newton step. O(V + K).

    Parameters
    ----------
    line, foot
        The curve and the points' nearest places on it.
    scale_mm
        (K,) scales of the weights.
    tangents
        (M, 2) directions of the curve, smoother than its segments. Orthogonal distances draw a segment that
        is shorter than the noise is thick into the direction of the noise; measured across a direction that
        is right on average they do not.
    count
        The points' multiplicities: then the step is towards the median, else Tukey's.

    """
    normals, cosine = _node_normals(line.nodes_mm, line.starts)
    diagonal, upper, right, number, square = _normal_equations(
        foot.segment,
        foot.t,
        foot.distance_mm,
        _skew(line.nodes_mm, line.starts, tangents),
        line.starts,
        cosine,
        scale_mm,
        *_multiplicity(count),
    )
    offset: Floats = _offsets(diagonal, upper, right, line.starts)
    return Step(
        Polyline(line.nodes_mm + offset[:, None] * normals, line.starts),
        diagonal,
        _pooled_scale(number, square, scale_mm),
    )


def smooth_tangents(line: Polyline) -> Floats:
    """(M, 2) mean direction of each segment and the two on either side, as far as the curve does not turn."""
    smooth: Floats = _smooth_tangents(line.nodes_mm, line.starts)
    return smooth


def _multiplicity(count: Floats | None) -> tuple[bool, Floats]:
    return count is None, np.empty(0) if count is None else count


@njit(cache=True, nogil=True, error_model="numpy")
def _steps(nodes: Floats, starts: Ints) -> tuple[Floats, Floats]:
    """(M, 2) steps of the segments and (M,) their lengths."""
    steps, lengths = np.empty((len(starts), 2)), np.empty(len(starts))
    for k in range(len(starts)):
        for e in range(2):
            steps[k, e] = nodes[starts[k] + 1, e] - nodes[starts[k], e]
        lengths[k] = np.sqrt(steps[k, 0] ** 2 + steps[k, 1] ** 2)
    return steps, lengths


@njit(cache=True, nogil=True, error_model="numpy")
def _smooth_tangents(nodes: Floats, starts: Ints) -> Floats:
    steps, lengths = _steps(nodes, starts)
    smooth: Floats = np.empty_like(steps)
    for k in range(len(starts)):
        z, r = steps[k, 0], steps[k, 1]
        for j in range(max(k - 2, 0), min(k + 3, len(starts))):
            cosine = (steps[j, 0] * steps[k, 0] + steps[j, 1] * steps[k, 1]) / (lengths[j] * lengths[k])
            if j != k and starts[j] - starts[k] == j - k and cosine > _ALIKE:
                z, r = z + steps[j, 0], r + steps[j, 1]
        length = np.sqrt(z * z + r * r)
        smooth[k, 0], smooth[k, 1] = z / length, r / length
    return smooth


@njit(cache=True, nogil=True, error_model="numpy")
def _skew(nodes: Floats, starts: Ints, tangents: Floats) -> Floats:
    """(M,) by how much of a segment the foot of a point moves per distance, measured across the tangents."""
    steps, lengths = _steps(nodes, starts)
    skew = np.empty(len(starts))
    for k in range(len(starts)):
        along = (tangents[k, 0] * steps[k, 0] + tangents[k, 1] * steps[k, 1]) / lengths[k]
        across = tangents[k, 0] * steps[k, 1] - tangents[k, 1] * steps[k, 0]
        skew[k] = across / (lengths[k] ** 2 * max(along, 0.3))
    return skew


@njit(cache=True, nogil=True, error_model="numpy")
def _node_normals(nodes: Floats, starts: Ints) -> tuple[Floats, Floats]:
    """(K, 2) unit bisecting normals, and (M, 2) their cosines to the normals of the segments they bound."""
    steps, lengths = _steps(nodes, starts)
    total, cosine = np.zeros_like(nodes), np.empty((len(starts), 2))
    for k in range(len(starts)):
        for node in (starts[k], starts[k] + 1):
            total[node, 0] -= steps[k, 1] / lengths[k]
            total[node, 1] += steps[k, 0] / lengths[k]
    for i in range(len(nodes)):
        length = max(np.sqrt(total[i, 0] ** 2 + total[i, 1] ** 2), 1e-12)
        total[i, 0], total[i, 1] = total[i, 0] / length, total[i, 1] / length
    for k in range(len(starts)):
        for e in range(2):
            z, r = total[starts[k] + e]
            cosine[k, e] = max((r * steps[k, 0] - z * steps[k, 1]) / lengths[k], 0.3)
    return total, cosine


@njit(cache=True, nogil=True, error_model="numpy")
def _offsets(diagonal: Floats, upper: Floats, right: Floats, starts: Ints) -> Floats:
    """Solution of the stiffened tridiagonal system, by elimination (it is positive definite)."""
    size = len(diagonal)
    stiffness = _STIFFNESS * diagonal.mean() + 1e-300
    pivot, beside, offset = diagonal + 1e-9 * stiffness, upper.copy(), right.copy()
    for node in starts:
        pivot[node] += stiffness
        pivot[node + 1] += stiffness
        beside[node] -= stiffness
    for i in range(1, size):
        factor = beside[i - 1] / pivot[i - 1]
        pivot[i] -= factor * beside[i - 1]
        offset[i] -= factor * offset[i - 1]
    offset[size - 1] /= pivot[size - 1]
    for i in range(size - 2, -1, -1):
        offset[i] = (offset[i] - beside[i] * offset[i + 1]) / pivot[i]
    return offset


@njit(cache=True, nogil=True, error_model="numpy")
def _normal_equations(
    segment: Ints32,
    t: Floats,
    distance: Floats,
    skew: Floats,
    starts: Ints,
    cosine: Floats,
    scale: Floats,
    tukey: bool,  # noqa: FBT001 (numba takes no keywords only)
    multiple: Floats,
) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    nodes = len(scale)
    diagonal, upper, right = np.zeros(nodes), np.zeros(nodes), np.zeros(nodes)
    count, square = np.zeros(nodes), np.zeros(nodes)
    for i in range(len(segment)):
        k = segment[i]
        if k < 0:
            continue
        node, d = starts[k], distance[i]
        at = min(max(t[i] - d * skew[k], 0.0), 1.0)
        s = scale[node] * (1.0 - t[i]) + scale[node + 1] * t[i]
        if tukey:
            x = d / (TUKEY * s)
            w = (1.0 - x * x) ** 2 if -1.0 < x < 1.0 else 0.0
        else:
            w = multiple[i] / max(abs(d) / s, 0.5)
        near = node if t[i] < 0.5 else node + 1
        if abs(d) < 3.0 * s:
            count[near] += 1.0
            square[near] += d * d
        if w == 0.0:
            continue
        a, b = (1.0 - at) * cosine[k, 0], at * cosine[k, 1]
        diagonal[node] += w * a * a
        diagonal[node + 1] += w * b * b
        upper[node] += w * a * b
        right[node] += w * a * d
        right[node + 1] += w * b * d
    return diagonal, upper, right, count, square


def _pooled_scale(count: Floats, square: Floats, before: Floats) -> Floats:
    """Standard deviation of the data within three sigma (mended by 1.4 %), pooled over neighbours."""
    kernel = np.ones(3)
    pooled = np.convolve(count, kernel, mode="same")
    total = np.convolve(square, kernel, mode="same")
    overall = np.sqrt(square.sum() / max(count.sum(), 1.0))
    scale = 1.014 * np.sqrt(total / np.maximum(pooled, 1.0))
    return np.where(pooled >= 8.0, np.maximum(scale, 0.05 * overall), before) + 1e-300
