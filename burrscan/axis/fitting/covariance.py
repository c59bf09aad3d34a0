"""The uncertainty of a fitted axis, and what the data leave open."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from burrscan.arrays import Floats
from burrscan.axis.fitting.correlation import Scores, widened
from burrscan.axis.fitting.correlogram import Correlation, correlation_of
from burrscan.axis.fitting.fit import (
    TUKEY,
    Curve,
    Fit,
    add_square,
    curve_of,
    meridian,
    off_piece,
    piece_of,
)
from burrscan.axis.fitting.ridges import Pieces
from burrscan.axis.fitting.scales import Thickness, relative_scales
from burrscan.axis.jit import kernel

SECTORS = 64
"""Of a whole turn, 5.6° each: wide enough to hold a burr or a spoke, many enough to tell their
disagreement."""
BINS_ALONG = 16
"""Places along a piece, over its whole reach of ±2 spacings."""
REACH_ALONG = 4.0
"""Spacings that the places along a piece go over."""
PAIR = 2
"""Sectors told apart for the length of a correlation: 11° together halve the matrices."""


@dataclass(frozen=True)
class AxisCovariance:
    """Covariance of (tilt, tilt, offset, offset) in a fit's frame.

    Parameters
    ----------
    covariance
        (4, 4) dimensionless.
    noise
        Standard deviation of the raw points about the generatrix.
    independent
        Number of independent points that would tell as much: the points over what their errors share.
    freedom
        Degrees of freedom behind the covariance: pairs of sectors that hold points, less the four of the fit.

    """

    covariance: Floats
    noise: float
    independent: float
    freedom: float


@kernel
def _tally(
    points: Floats,
    raw: Floats,
    weights: Floats,
    frame: Floats,
    place: Floats,
    curve: Curve,
    relative: Floats,
    limit: float,
    response: Floats,
    gram: Floats,
    scores: Floats,
    slopes: Floats,
) -> Floats:
    """Everything :func:`covariance_of` needs, in one pass.

    ``scores`` sums w, w d, w J, w d J, w d² per piece, place along it and sector of angle. ``slopes`` (K, 2,
    5, 5) sums, per piece, w K Kᵀ and w v K Kᵀ with v the variance of the slope and K 1 and
    the change of J with it. The result is Σ w J Jᵀ. The piece and J of a point come
    from its smoothed position, its residual from the raw one: smoothing correlates neighbours, and what the
    pose makes of a neighbourhood's noise it hardly changes. Inliers count fully: a weight that shrinks with
    the residual would shrink the stated uncertainty.
    """
    A, J, K = np.zeros((4, 4)), np.empty(4), np.ones(5)
    for i in range(points.shape[0]):
        x, y, z = meridian(points, i, frame, place)
        r = np.sqrt(x * x + y * y)
        k = piece_of(z, r, curve)
        if k < 0:
            continue
        t, d, mz, mr = off_piece(z, r, k, curve)
        w = (weights[i] if weights.shape[0] > 0 else 1.0) / relative[k] ** 2
        if abs(d) * np.sqrt(w) >= limit:
            continue
        cosine, sine = x / r, y / r
        g, h = z * mr - r * mz, z * mz + r * mr
        lean = response[k]
        J[0], J[1], J[2], J[3] = -g * sine, g * cosine, mr * cosine, mr * sine
        for p in range(4):
            J[p] -= lean[0, p] + t * (lean[1, p] + t * lean[2, p])
        K[1], K[2], K[3], K[4] = -h * sine, h * cosine, mz * cosine, mz * sine
        v = gram[k, 1, 1] + 4.0 * t * (gram[k, 1, 2] + t * gram[k, 2, 2])
        size = abs(x) + abs(y)
        turn = (1.0 - x / size if y >= 0.0 else 3.0 + x / size) * (SECTORS / 4)  # monotone in the angle
        a, b, c = meridian(raw, i, frame, place)
        d += (c - z) * mz + ((a - x) * cosine + (b - y) * sine) * mr
        u = min(BINS_ALONG - 1, max(0, int((t * 0.25 + 0.5) * BINS_ALONG)))
        row = scores[k, u, int(turn) % SECTORS]
        row[0] += w
        row[1] += w * d
        row[10] += w * d * d
        for p in range(4):
            row[2 + p] += w * J[p]
            row[6 + p] += w * d * J[p]
        add_square(A, w, J)
        add_square(slopes[k, 0], w, K)
        add_square(slopes[k, 1], w * v, K)
    return A


def _spurious(slopes: Floats, spacing: float) -> Floats:
    """Information that the noise of the generatrix's slopes feigns, per unit variance of a point."""
    mean = slopes[:, 0, 1:, 0] / np.maximum(slopes[:, 0, 0, 0], 1e-300)[:, None]
    cross = np.einsum("kp,kq->pq", slopes[:, 1, 1:, 0], mean)
    total = slopes[:, 1, 1:, 1:].sum(axis=0) - cross - cross.T
    total += np.einsum("k,kp,kq->pq", slopes[:, 1, 0, 0], mean, mean)
    return np.asarray(total / spacing**2)


def covariance_of(points: Floats, raw: Floats, weights: Floats, fit: Fit, thick: Thickness) -> AxisCovariance:
    """Uncertainty of a fit. O(V).

    The information matrix, each piece of the generatrix by its own noise, less what the slopes' noise feigns
    of it, times the variance of the raw residuals; widened by what errors that reach over many points add
    (:mod:`burrscan.axis.fitting.correlogram`, :mod:`burrscan.axis.fitting.correlation`), as with
    correlated noise, burrs along the axis, treads, or a part that is not round; and by the square of the step
    that the raw residuals would make of it: smoothing and the choice of points near edges draw by about that.
    """
    scores = np.zeros((len(fit.coefficients), BINS_ALONG, SECTORS, 11))
    slopes = np.zeros((len(fit.coefficients), 2, 5, 5))
    relative = relative_scales(thick, fit)
    A = _tally(
        points, raw, weights, fit.frame, fit.place, curve_of(fit), relative, TUKEY * fit.sigma,
        fit.response, fit.gram, scores, slopes,
    )  # fmt: skip
    told = _condensed(scores, relative)
    variance = max(told.squares / max(told.freedom - 4.0, 1.0), 1e-300)
    spurious = variance * _spurious(slopes, fit.pieces.spacing)
    shared = correlation_of(
        told.counts,
        told.residuals / np.sqrt(variance),
        radius=float(np.median(fit.pieces.centre[:, 1])),
        along=REACH_ALONG * fit.pieces.spacing / BINS_ALONG,
    )
    return _composed(A - told.known, spurious, told, variance, fit.pieces, shared)


class _Told(NamedTuple):
    """What the scores say once the means along parallels are off.

    Parameters
    ----------
    known
        Σ w J̄ J̄ᵀ, the part of the information that the generatrix takes.
    sums, shares
        Per sector, over all pieces, Σ w (d - d̄) (J - J̄) and the information Σ w (J - J̄) (J - J̄)ᵀ.
    lifts
        Per piece and sector, Σ w (J - J̄) for an error of one standard deviation.
    weights
        Σ w per sector.
    counts, residuals
        Per piece, place along it and sector: the weight of its points, and Σ w (d - d̄), for noise that is the
        same everywhere.
    squares, freedom
        Σ w (d - d̄)²; and the weight less the number of means.

    """

    known: Floats
    sums: Floats
    shares: Floats
    lifts: Floats
    weights: Floats
    counts: Floats
    residuals: Floats
    squares: float
    freedom: float


def _condensed(scores: Floats, relative: Floats) -> _Told:
    """Take the means along parallels off the scores (K, BINS_ALONG, SECTORS, 11).

    ``relative`` (K,) is the noise of the pieces, see :func:`burrscan.axis.fitting.scales.relative_scales`.

    The generatrix is free: only what changes along a parallel tells of the axis, and what smoothing moved
    alike all round (at edges) is no noise.
    """
    total = scores.sum(axis=2)
    weight = np.maximum(total[..., 0], 1e-300)
    mean = total / weight[..., None]
    seen = scores[..., 0] > 0.0
    d, J = mean[:, :, None, 1], mean[:, :, None, 2:6]
    lift = scores[..., 2:6] - scores[..., :1] * J
    pull = (
        scores[..., 6:10]
        - d[..., None] * scores[..., 2:6]
        - J * (scores[..., 1] - d * scores[..., 0])[..., None]
    )
    lean = lift / np.where(seen, scores[..., 0], 1.0)[..., None]
    return _Told(
        known=np.einsum("kup,kuq->pq", total[..., 2:6], mean[..., 2:6]),
        sums=pull.sum(axis=(0, 1)),
        shares=np.einsum("kusp,kusq->spq", lift, lean),
        lifts=lift.sum(axis=1) * relative[:, None, None],
        weights=scores[..., 0].sum(axis=(0, 1)),
        counts=scores[..., 0] * relative[:, None, None] ** 2,
        residuals=(scores[..., 1] - d * scores[..., 0]) * relative[:, None, None],
        squares=float((total[..., 10] - total[..., 1] * mean[..., 1]).sum()),
        freedom=float((total[..., 0] - 1.0)[total[..., 0] > 0.0].sum()),
    )


def _composed(
    A: Floats, spurious: Floats, told: _Told, variance: float, pieces: Pieces, shared: Correlation
) -> AxisCovariance:
    """Compose the covariance in the basis where A is the identity, mode by mode."""
    values, vectors = np.linalg.eigh(A)
    whiten = vectors / np.sqrt(np.maximum(values, 1e-12 * max(values[-1], 1e-100)))
    weights = _paired(told.weights, 0)
    wide = widened(
        Scores(
            sums=_paired(told.sums @ whiten, 0) / np.sqrt(variance),
            shares=_paired(whiten.T @ told.shares @ whiten, 0),
            lifts=_paired(told.lifts @ whiten, 1),
            weights=weights,
            places=pieces.centre,
            normals=pieces.normal,
            spacing=pieces.spacing,
            shared=shared,
        )
    )
    step = whiten @ (whiten.T @ told.sums.sum(axis=0))
    real, modes = np.linalg.eigh(np.eye(4) - whiten.T @ spurious @ whiten)
    basis = whiten @ (modes / np.sqrt(np.maximum(real, 0.01)))
    covariance = basis @ (modes.T @ wide @ modes) @ basis.T * variance + np.outer(step, step)
    independent = float(told.weights.sum()) / (0.25 * float(np.trace(wide)))
    freedom = max(float(np.count_nonzero(weights)) - 4.0, 1.0)
    return AxisCovariance(covariance, float(np.sqrt(variance)), independent, freedom)


def _paired(values: Floats, axis: int) -> Floats:
    """Sectors along an axis of an array, added up two by two."""
    shape = values.shape
    pairs = values.reshape(*shape[:axis], SECTORS // PAIR, PAIR, *shape[axis + 1 :])
    return np.asarray(pairs.sum(axis=axis + 1))
