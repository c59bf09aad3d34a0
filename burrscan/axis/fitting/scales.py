"""How thick each piece of a generatrix is, and how likely that makes a fit.

A flat face seen well is thin; a round side with flutes or lugs is thick, for not all of it is on one parallel.
One noise for all, that of the face, leaves nearly all of the side out, and the few points of it that come near
the generatrix by chance then decide where the axis lies.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from burrscan.arrays import Floats, Ints
from burrscan.axis.fitting.fit import FEWEST, TUKEY, Curve, Fit, curve_of, meridian, off_piece, piece_of
from burrscan.axis.jit import kernel
from burrscan.robust import MEDIAN_SIZE

ROUND = 0.5
"""Radial part of a generatrix's normal from which a point tells where the axis lies: up to 60° off radial."""
SURE = 3.0
"""Standard errors of a piece's scale by which it must exceed the noise of the fit."""
MEDIAN_ERROR = 1.17
"""Standard error of a scale by the median, in units of the scale over the root of the number of points."""


class Deviations(NamedTuple):
    """What V points are off a fit's generatrix.

    Parameters
    ----------
    piece
        (V,) number of the piece, -1 beyond the reach of all.
    off
        (V,) distance off it, NaN beyond.
    radial
        (V,) radial part of the generatrix's normal there, 0 beyond.

    """

    piece: Ints
    off: Floats
    radial: Floats


@kernel
def _deviations(points: Floats, frame: Floats, place: Floats, curve: Curve) -> tuple[Ints, Floats, Floats]:
    n = points.shape[0]
    piece, off, radial = np.full(n, -1, np.int64), np.full(n, np.nan), np.zeros(n)
    for i in range(n):
        x, y, z = meridian(points, i, frame, place)
        r = np.sqrt(x * x + y * y)
        k = piece_of(z, r, curve)
        if k >= 0:
            _, off[i], _, radial[i] = off_piece(z, r, k, curve)
            piece[i] = k
    return piece, off, radial


def deviations(points: Floats, fit: Fit) -> Deviations:
    """Of (V, 3) points off the generatrix of a fit. O(V)."""
    return Deviations(*_deviations(points, fit.frame, fit.place, curve_of(fit)))


def piece_scales(seen: Deviations, fit: Fit) -> Floats:
    """(K,) robust standard deviations off each piece; that of the fit where there are few points. O(V log V)."""
    order = np.lexsort((np.abs(seen.off), seen.piece))
    order = order[np.count_nonzero(seen.piece < 0) :]
    count = np.bincount(seen.piece[order], minlength=len(fit.coefficients))
    first = np.append(0, np.cumsum(count)[:-1])
    some = count >= FEWEST
    scales = np.full(len(count), fit.sigma)
    middle = order[(first + count // 2)[some]]
    scales[some] = np.abs(seen.off[middle]) / MEDIAN_SIZE
    return scales


def round_share(seen: Deviations, fit: Fit) -> float:
    """Share of inliers among the points that tell where the axis lies; beyond all pieces is no inlier."""
    telling = (np.abs(seen.radial) > ROUND) | (seen.piece < 0)
    inliers = np.abs(seen.off[telling]) < TUKEY * fit.sigma
    return float(inliers.mean()) if len(inliers) else 1.0


def unlikelihood(points: Floats, seen: Deviations, fit: Fit) -> float:
    """Negative log likelihood of a point, on average, by the density that the points of a fit themselves have.

    In space it is that in the (z, r) plane over 2πr. There it is a mixture: each piece has its share of the
    points and its thickness, and what is beyond all pieces is spread over the whole plane. Up to what is the
    same for all fits to the same points.

    Parameters
    ----------
    points
        (V, 3) in the canonical frame, less than ten thousand of them will do.
    seen, fit
        What they are off it.

    """
    across = (points - fit.place) @ fit.frame
    radius = np.hypot(across[:, 0], across[:, 1])
    known = seen.piece >= 0
    share = np.bincount(seen.piece[known], minlength=len(fit.coefficients)) / len(points)
    thick = np.maximum(piece_scales(seen, fit), fit.sigma)
    beyond = 1.0 - float(known.mean())
    plane = max(float(np.ptp(across[:, 2]) * np.ptp(radius)) / fit.pieces.spacing, 1e-300)
    some = share > 0.0
    spread = share[some] @ (np.log(thick[some]) - np.log(share[some]))
    if beyond > 0.0:
        spread += beyond * (np.log(plane) - np.log(beyond))
    return float(spread + np.log(np.maximum(radius, 1e-300)).mean())


def relative_scales(seen: Deviations, fit: Fit) -> Floats:
    """(K,) how much thicker than the noise of the fit each piece surely is; 1 where that is not sure."""
    count = np.bincount(seen.piece[seen.piece >= 0], minlength=len(fit.coefficients))
    ratio = piece_scales(seen, fit) / fit.sigma
    sure = ratio > 1.0 + SURE * MEDIAN_ERROR / np.sqrt(np.maximum(count, 1.0))
    return np.where(sure, ratio, 1.0)
