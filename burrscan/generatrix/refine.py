"""Robust least squares of a polyline in the (z, r) plane: nodes move along their normals.

Each point's signed normal distance depends linearly on the offsets of the two nodes of its segment, so that
every step solves one tridiagonal system per piece. Weights are Tukey's, with a scale per node.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.linalg import solveh_banded

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
    normals, cosine = _node_normals(line)
    diagonal, upper, right, number, square = _normal_equations(
        foot.segment,
        foot.t,
        foot.distance_mm,
        _skew(line, tangents),
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
    steps, unit = line.steps_mm, line.steps_mm / line.lengths_mm[:, None]
    total, count = steps.copy(), len(steps)
    for ahead in range(1, min(3, count)):
        one, other = slice(None, count - ahead), slice(ahead, None)
        alike = (line.starts[other] - line.starts[one] == ahead) & (
            (unit[one] * unit[other]).sum(axis=1) > _ALIKE
        )
        total[one] += alike[:, None] * steps[other]
        total[other] += alike[:, None] * steps[one]
    return np.asarray(total / np.hypot(*total.T)[:, None])


def _multiplicity(count: Floats | None) -> tuple[bool, Floats]:
    return count is None, np.empty(0) if count is None else count


def _skew(line: Polyline, tangents: Floats) -> Floats:
    """(M,) by how much of a segment the foot of a point moves per distance, measured across the tangents."""
    steps, lengths = line.steps_mm, line.lengths_mm
    along = (tangents * steps).sum(axis=1) / lengths
    across = tangents[:, 0] * steps[:, 1] - tangents[:, 1] * steps[:, 0]
    return np.asarray(across / (lengths**2 * np.maximum(along, 0.3)))


def _node_normals(line: Polyline) -> tuple[Floats, Floats]:
    """(K, 2) unit bisecting normals, and (M, 2) their cosines to the normals of the segments they bound."""
    total, ends = np.zeros_like(line.nodes_mm), (line.starts, line.starts + 1)
    for nodes in ends:
        total[nodes] += line.normals  # each node begins one segment at most, and ends one
    total /= np.maximum(np.hypot(*total.T), 1e-12)[:, None]
    cosine = np.stack([(total[nodes] * line.normals).sum(axis=1) for nodes in ends], axis=1)
    return total, np.maximum(cosine, 0.3)


def _offsets(diagonal: Floats, upper: Floats, right: Floats, starts: Ints) -> Floats:
    """Solution of the stiffened tridiagonal system (it is positive definite)."""
    stiffness = _STIFFNESS * diagonal.mean() + 1e-300
    banded = np.stack([np.roll(upper, 1), diagonal + 1e-9 * stiffness])
    banded[0, starts + 1] -= stiffness
    for nodes in (starts, starts + 1):
        banded[1, nodes] += stiffness
    return np.asarray(solveh_banded(banded, right))


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
