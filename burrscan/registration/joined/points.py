"""What the points of one view say of its pose against the part and of the curve that all views share.

The residual of a point is its distance off the curve in the (z, r) plane of the axis, along the curve's
normal (:mod:`burrscan.axis.fitting.fit` has the pieces). A small motion of the view changes it by the motion
of the point along that normal; a turn about the axis changes nothing.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from burrscan.arrays import Floats
from burrscan.axis.fitting.fit import Curve, add_square, off_piece, piece_of
from burrscan.axis.jit import kernel
from burrscan.robust import SIGMA_PER_MEDIAN

UNKNOWNS = 6
"""Of a view: a rotation vector and a translation in the part frame."""
SECTORS = 64
"""Of a turn: as wide as burrs and lugs, whose points err together."""
_FEWEST = 4
"""Sectors of a piece whose means say how far sectors scatter."""


class Rows(NamedTuple):
    """Sums over the points of a view, each with its weight w, place t on its piece and distance d off it.

    Parameters
    ----------
    sums
        (K, 10, 10) of w v vᵀ per piece with v = (1, t, t², J, d), J (6,) what a small motion does to d.
    z
        (V,) distances over their standard deviations; NaN off the curve.
    shares
        (K, SECTORS) what a point there counts, over what it would if it erred by itself.

    """

    sums: Floats
    z: Floats
    shares: Floats


@kernel
def at(point: Floats, pose: Floats) -> tuple[float, float, float, float]:
    """A point (3,) at a pose (4, 4): x, y, z and its distance from the axis."""
    a, b, c = point[0], point[1], point[2]
    x = pose[0, 0] * a + pose[0, 1] * b + pose[0, 2] * c + pose[0, 3]
    y = pose[1, 0] * a + pose[1, 1] * b + pose[1, 2] * c + pose[1, 3]
    z = pose[2, 0] * a + pose[2, 1] * b + pose[2, 2] * c + pose[2, 3]
    return x, y, z, np.sqrt(x * x + y * y)


@kernel
def _lever(J: Floats, x: float, y: float, z: float, mz: float, mr: float) -> None:
    """Into (6,) J how a small motion changes a point's distance off the curve of normal (mz, mr)."""
    r = np.sqrt(x * x + y * y)
    nx, ny = mr * x / r, mr * y / r
    J[0], J[1], J[2] = y * mz - z * ny, z * nx - x * mz, 0.0
    J[3], J[4], J[5] = nx, ny, mz


def rows_of(
    points: Floats,
    sigma: Floats,
    pose: Floats,
    curve: Curve,
    limit: float,
    *,
    robust: bool,
    shared: bool,
) -> Rows:
    """The rows of (V, 3) points at a pose (4, 4) in the part frame. O(V).

    Points beyond ``limit`` standard deviations have no weight; within it Tukey's, or all the same where not
    ``robust``, times their share, which is 1 where errors are not ``shared``.
    """
    shares = np.ones((len(curve.centre), SECTORS))
    if shared:
        shares = shares_of(*_sectors(points, sigma, pose, curve, limit))
    sums = np.zeros((len(curve.centre), 4 + UNKNOWNS, 4 + UNKNOWNS))
    z = _summed(points, sigma, pose, curve, limit, robust, shares, sums)
    return Rows(sums, z, shares)


def shares_of(weight: Floats, pull: Floats) -> Floats:
    """(K, SECTORS) what a point counts where those beside it err with it, over what it would by itself.

    At a corner, whose pixels see both faces, and where light came over another surface, the points of a piece
    err together in every sector, by far more than their number leaves of their noise; a few such pieces
    would turn the axis. Each sector of a piece is taken to have an error of its own (random effects;
    DerSimonian & Laird 1986). Its variance is what the sectors' means scatter by beyond their noise, by
    their median: burrs are in few of them.

    Parameters
    ----------
    weight, pull
        (K, SECTORS) summed weights of the points, and of their distances off the curve.

    """
    shares = np.ones_like(weight)
    for own, weights, pulls in zip(shares, weight, pull, strict=True):
        seen = weights > 0.0
        if np.count_nonzero(seen) < _FEWEST:
            continue
        means = pulls[seen] / weights[seen]
        scatter = SIGMA_PER_MEDIAN * np.median(np.abs(means - np.median(means)))
        shared = max(float(scatter**2 - np.median(1.0 / weights[seen])), 0.0)
        own[seen] = 1.0 / (1.0 + weights[seen] * shared)
    return shares


@kernel
def _sector(x: float, y: float) -> int:
    return int((np.arctan2(y, x) / (2.0 * np.pi) + 0.5) * SECTORS) % SECTORS


@kernel
def _sectors(
    points: Floats, sigma: Floats, pose: Floats, curve: Curve, limit: float
) -> tuple[Floats, Floats]:
    """Per piece and sector (K, SECTORS) the weights of the points on the curve, and of their distances."""
    weight = np.zeros((curve.centre.shape[0], SECTORS))
    pull = np.zeros_like(weight)
    for i in range(points.shape[0]):
        x, y, z, r = at(points[i], pose)
        k = piece_of(z, r, curve)
        if k < 0 or r == 0.0:
            continue
        d = off_piece(z, r, k, curve)[1]
        if abs(d) < limit * sigma[i]:
            s, w = _sector(x, y), 1.0 / (sigma[i] * sigma[i])
            weight[k, s] += w
            pull[k, s] += w * d
    return weight, pull


@kernel
def _summed(
    points: Floats,
    sigma: Floats,
    pose: Floats,
    curve: Curve,
    limit: float,
    robust: bool,  # noqa: FBT001 (a kernel)
    shares: Floats,
    sums: Floats,
) -> Floats:
    """Add to the sums of :class:`Rows`; the points' (V,) z."""
    scores, v = np.full(points.shape[0], np.nan), np.ones(sums.shape[1])
    for i in range(points.shape[0]):
        x, y, z, r = at(points[i], pose)
        k = piece_of(z, r, curve)
        if k < 0 or r == 0.0:
            continue
        t, d, mz, mr = off_piece(z, r, k, curve)
        scores[i] = d / sigma[i]
        size = abs(scores[i]) / limit
        if size < 1.0:
            w = shares[k, _sector(x, y)] / (sigma[i] * sigma[i])
            if robust:
                w *= (1.0 - size * size) ** 2
            v[1], v[2], v[-1] = t, t * t, d
            _lever(v[3:-1], x, y, z, mz, mr)
            add_square(sums[k], w, v)
    return scores


@kernel
def sector_pulls(
    points: Floats,
    sigma: Floats,
    pose: Floats,
    curve: Curve,
    limit: float,
    shares: Floats,
    response: Floats,
) -> tuple[Floats, Floats]:
    """Per sector (64, 6) what its points pull, and (6, 6) what they tell, once the curve has its share.

    ``shares`` are those of :class:`Rows`; ``response`` (K, 3, 6) is the change of the curve by the pose.
    """
    pulls, square, J = np.zeros((SECTORS, 6)), np.zeros((6, 6)), np.zeros(6)
    for i in range(points.shape[0]):
        x, y, z, r = at(points[i], pose)
        k = piece_of(z, r, curve)
        if k < 0 or r == 0.0:
            continue
        t, d, mz, mr = off_piece(z, r, k, curve)
        if abs(d) >= limit * sigma[i]:
            continue
        s = _sector(x, y)
        w = shares[k, s] / (sigma[i] * sigma[i])
        _lever(J, x, y, z, mz, mr)
        lean = response[k]
        for p in range(6):
            J[p] -= lean[0, p] + t * (lean[1, p] + t * lean[2, p])
        for p in range(6):
            pulls[s, p] += w * d * J[p]
            for q in range(6):
                square[p, q] += w * J[p] * J[q]
    return pulls, square
