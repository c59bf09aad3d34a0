"""What errors that reach along the surface make of an axis's variance.

Errors of real scans are alike over many points: those of decoding windows, of a calibration, of a part that
is not quite round. What neighbours share the residuals say (:mod:`burrscan.axis.fitting.correlogram`).
Besides, errors may reach further than that shows: then the scores of neighbouring sectors (the gradient of
the fit, sector by sector) agree by more. Lengths and sizes on a grid are weighed by their restricted
likelihood (Patterson & Thompson 1971), that of what the fit leaves: what it has followed of such errors is
allowed for. The variance is the mean over the grid, so that what few sectors leave open of the correlation
widens it too.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Floats, Ints
from burrscan.axis.fitting.correlogram import Correlation, alike

LENGTHS = (0.1, 0.2, 0.4, 0.8)
"""Of the correlation (sigma of a Gaussian), in rms radii: from what one sector holds to half a view."""
SIZES = np.array([0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0])
"""Variance that correlated errors add to the axis, in units of what independent ones make."""
LOBES = (2, 3)
"""Waves round the part of a turned part that is not quite round: gripped in a vice, or in a chuck's three
jaws."""
AGAINST = 4.0
"""Odds, before the data are seen, that errors reach no further than neighbours show."""
SINGULAR = 1e-6
"""Eigenvalues of a correlation below this share of the largest are rounding."""
NARROW = 1e-4
"""A direction with less than this share of the largest information of a sector says nothing."""
FEWEST_MODES = 2.0
"""Fewer degrees of freedom are none: the series for the quantile ends there."""
FEWEST = 4
"""Numbers beyond the four of the pose that a likelihood needs."""


@dataclass(frozen=True)
class Scores:
    """What S sectors say of a fit, in the basis where the information of the axis is the identity.

    Parameters
    ----------
    sums
        (S, 4) gradients of the fit, in standard deviations of a point.
    shares
        (S, 4, 4) information; they sum up to the identity.
    lifts
        (K, S, 4) what an error of one standard deviation does to a score that all points of a piece of the
        generatrix share in a sector.
    weights
        (S,) of the points.
    places, normals
        (K, 2) of the pieces in the (z, r) plane.
    spacing
        Of the pieces along the generatrix.
    shared
        What neighbouring points share.

    """

    sums: Floats
    shares: Floats
    lifts: Floats
    weights: Floats
    places: Floats
    normals: Floats
    spacing: float
    shared: Correlation


def widened(scores: Scores) -> Floats:
    """(4, 4) covariance of the axis in the basis of the scores; the identity if errors are each point's own.

    O(S³) for each length.
    """
    seen = np.flatnonzero(scores.weights > 1e-3 * scores.weights.max())
    if not len(seen):
        return np.eye(4)
    lifts = scores.lifts[:, seen]
    own_share = scores.shared.own
    around, across = _neighbours(scores, seen)
    near = own_share * np.eye(4) + scores.shared.share * _total(lifts, around, across)
    # A narrow sector tells of two directions only: a tilt and a shift in its own meridian.
    values, vectors = (part[..., -2:] for part in np.linalg.eigh(scores.shares[seen]))
    told = values.ravel() > NARROW * values.max()
    if np.count_nonzero(told) < 4 + FEWEST:
        return near
    white = (vectors / np.sqrt(np.maximum(values, 1e-300))[:, None, :]).transpose(0, 2, 1)
    data = np.einsum("sep,sp->se", white, scores.sums[seen]).ravel()[told]
    design = np.einsum("sep,spq->seq", white, scores.shares[seen]).reshape(-1, 4)[told]
    local = np.einsum("sep,ksp->kse", white, lifts).reshape(len(lifts), -1)[:, told]
    sector = np.ix_(*2 * (np.repeat(np.arange(len(seen)), 2)[told],))
    root = _inverse_root(
        own_share * np.eye(len(data)) + scores.shared.share * (local.T @ across @ local) * around[sector]
    )
    log_weights, found = [], []
    for around, across in _kernels(scores, seen):
        further = root @ ((local.T @ across @ local) * around[sector]) @ root
        far = _total(lifts, around, across)
        unit = float(np.trace(near)) / max(float(np.trace(far)), 1e-300)
        logs, scale, sizes = _evidence(unit * further, root @ design, root @ data)
        log_weights.append(logs)
        found.append(scale[:, None, None] * (near + sizes[:, None, None] * unit * far))
    logs = np.array(log_weights)
    logs[:, 1:] -= np.log(AGAINST * len(SIZES))
    weights = np.exp(logs - logs.max())
    return np.asarray(np.einsum("ls,lspq->pq", weights / weights.sum(), np.array(found)))


def _neighbours(scores: Scores, seen: Ints) -> tuple[Floats, Floats]:
    """Correlations of what neighbours share: between sectors (S, S), and between pieces (K, K)."""
    chord, centre, apart, radius = _distances(scores, seen)
    width = 2.0 * np.pi * radius / len(scores.weights)
    around = centre @ alike(chord**2, scores.shared.reach, width) @ centre.T
    return around, alike(apart**2, scores.shared.reach, scores.spacing)


def _distances(scores: Scores, seen: Ints) -> tuple[Floats, Floats, Floats, float]:
    """Between sectors (S, S), what takes a parallel's mean off, between pieces (K, K), and the radius."""
    radius = float(np.median(scores.places[:, 1]))
    chord = 2.0 * radius * np.sin(0.5 * _turns(scores, seen))
    share = scores.weights[seen] / scores.weights[seen].sum()
    apart = np.linalg.norm(scores.places[:, None] - scores.places, axis=2)
    return chord, np.eye(len(seen)) - share, apart, radius


def _turns(scores: Scores, seen: Ints) -> Floats:
    """(S, S) angles between sectors."""
    return np.asarray(2.0 * np.pi * (seen[:, None] - seen) / len(scores.weights))


def _inverse_root(matrix: Floats) -> Floats:
    """Symmetric inverse square root of a matrix that may be singular."""
    values, vectors = np.linalg.eigh(matrix)
    return np.asarray((vectors / np.sqrt(np.maximum(values, SINGULAR * values[-1]))) @ vectors.T)


def _kernels(scores: Scores, seen: Ints) -> Iterator[tuple[Floats, Floats]]:
    """Correlations of errors between sectors (S, S), the mean of a parallel off, and pieces (K, K)."""
    chord, centre, apart, _ = _distances(scores, seen)
    for length in LENGTHS:
        around = centre @ np.exp(-0.5 * (chord / length) ** 2) @ centre.T
        yield around, np.exp(-0.5 * (apart / length) ** 2)
        yield around, np.ones_like(apart)
    lift = scores.places[:, 1] * scores.normals[:, 1]
    lobes = sum(np.cos(n * _turns(scores, seen)) for n in LOBES)
    yield centre @ lobes @ centre.T, np.outer(lift, lift)


def _total(lifts: Floats, around: Floats, across: Floats) -> Floats:
    """(4, 4) variance of the sum of all scores."""
    k, s, p = lifts.shape
    one = (across @ lifts.reshape(k, s * p)).reshape(k, s, p)
    return np.asarray(np.einsum("stpq,st->pq", np.einsum("ksp,ktq->stpq", lifts, one, optimize=True), around))


def _evidence(shared: Floats, design: Floats, data: Floats) -> tuple[Floats, Floats, Floats]:
    """Restricted log likelihood, scale of the whole covariance, and sizes, without and at every size.

    A size is told by the modes in which it stands above the independent errors, less the four that the fit
    has taken. Few tell it badly: it grows by what makes ±1.96 sigma hold 95 %.
    """
    values, vectors = np.linalg.eigh(shared)
    X, y = vectors.T @ design, vectors.T @ data
    inverse = 1.0 / (1.0 + np.append(0.0, SIZES)[:, None] * values.clip(0.0))
    normal = np.einsum("mi,ip,iq->mpq", inverse, X, X, optimize=True)
    right = (inverse * y) @ X
    square = inverse @ (y * y) - np.einsum(
        "mp,mp->m", right, np.linalg.solve(normal, right[..., None])[..., 0]
    )
    free = len(y) - 4
    scale = np.maximum(1.0, square / free)  # points vary by no less than their own noise
    logs = np.log(inverse).sum(axis=1) - np.linalg.slogdet(normal)[1] - free * np.log(scale) - square / scale
    modes = np.maximum((1.0 - inverse).sum(axis=1) - 4.0, FEWEST_MODES)
    sizes = np.append(0.0, SIZES) * student_ratio(modes) ** 2
    return 0.5 * logs, 1.0 + (scale - 1.0) * free / (free - 2), sizes


def student_ratio(freedom: Floats) -> Floats:
    """Student's 97.5 % quantile over the normal one (Abramowitz & Stegun 26.7.5), from two degrees on."""
    square = 1.96**2
    first, second = (square + 1.0) / 4.0, (5.0 * square**2 + 16.0 * square + 3.0) / 96.0
    return np.asarray(1.0 + (first + second / freedom) / freedom)
