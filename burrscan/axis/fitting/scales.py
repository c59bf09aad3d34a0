"""How thick each piece of a generatrix is, and how likely that makes a fit.

A flat face seen well is thin; a round side with flutes or lugs is thick, for not all of it is on one
parallel. One noise for all, that of the face, leaves nearly all of the side out, and the few points of it
that come near the generatrix by chance then decide where the axis lies.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Floats
from burrscan.axis.fitting.fit import FEWEST, TUKEY, Curve, Fit, curve_of, meridian, off_piece, piece_of
from burrscan.axis.jit import kernel
from burrscan.robust import MEDIAN_SIZE

ROUND = 0.5
"""Radial part of a generatrix's normal from which a point tells where the axis lies: up to 60° off radial."""
THICKER = 2.0
"""Times the noise of the fit from which a piece has its own: at a corner, where a third of the points belong
to the next piece, the median says 1.8; on lugs and flutes it is ten and more."""
BINS = 512
"""Of the histogram that a median is read off, each 4 % wide."""
STEP = 0.04
"""Logarithm of the width of a bin: the first of them reaches down to e^-20 of the unit."""


@dataclass(frozen=True)
class Thickness:
    """What all points say of a fit's generatrix, piece by piece.

    Parameters
    ----------
    counts
        (K,) points of each piece.
    scales
        (K,) their robust standard deviation off it, that of the fit where they are few.
    beyond
        Number of points beyond the reach of all pieces.
    telling, inliers
        Number of points that tell where the axis lies, with those beyond, and of the inliers among them.
    log_radius
        Mean of the logarithm of the distance from the axis.
    plane
        Area of the (z, r) plane that the points span.

    """

    counts: Floats
    scales: Floats
    beyond: float
    telling: float
    inliers: float
    log_radius: float
    plane: float

    @property
    def round_share(self) -> float:
        """Share of inliers among the points that tell where the axis lies."""
        return self.inliers / self.telling if self.telling else 1.0


@kernel
def _spread(
    points: Floats, frame: Floats, place: Floats, curve: Curve, limit: float, spread: Floats
) -> tuple[float, float, float, Floats]:
    """Histograms of log |d| per piece; points beyond, those telling, their inliers; and what all span."""
    beyond, telling, inliers = 0.0, 0.0, 0.0
    span = np.array([np.inf, -np.inf, np.inf, -np.inf, 0.0])  # of z and r, and the sum of log r
    for i in range(points.shape[0]):
        x, y, z = meridian(points, i, frame, place)
        r = max(np.sqrt(x * x + y * y), 1e-12)
        span[0], span[1] = min(span[0], z), max(span[1], z)
        span[2], span[3] = min(span[2], r), max(span[3], r)
        span[4] += np.log(r)
        k = piece_of(z, r, curve)
        if k < 0:
            beyond += 1.0
            telling += 1.0
            continue
        _, d, _, radial = off_piece(z, r, k, curve)
        d = abs(d)
        spread[k, min(max(int(np.log(max(d, 1e-300)) / STEP) + BINS - 1, 0), BINS - 1)] += 1.0
        if abs(radial) > ROUND:
            telling += 1.0
            inliers += 1.0 if d < limit else 0.0
    return beyond, telling, inliers, span


def thickness_of(points: Floats, fit: Fit) -> Thickness:
    """What (V, 3) points in the canonical frame say of a fit. O(V)."""
    spread = np.zeros((len(fit.coefficients), BINS))
    beyond, telling, inliers, span = _spread(
        points, fit.frame, fit.place, curve_of(fit), TUKEY * fit.sigma, spread
    )
    upto = np.cumsum(spread, axis=1)
    counts = upto[:, -1]
    half = 0.5 * counts
    at = (upto < half[:, None]).sum(axis=1).clip(0, BINS - 1)
    rows = np.arange(len(spread))
    share = 1.0 - (upto[rows, at] - half) / np.maximum(spread[rows, at], 1.0)
    medians = np.exp(STEP * (at + share - BINS))
    scales = np.where(counts >= FEWEST, medians / MEDIAN_SIZE, fit.sigma)
    plane = float((span[1] - span[0]) * (span[3] - span[2]))
    return Thickness(counts, scales, beyond, telling, inliers, float(span[4]) / max(len(points), 1), plane)


def unlikelihood(thick: Thickness, fit: Fit) -> float:
    """Negative log likelihood of a point, on average, by the density of the points of the fit.

    In space it is that in the (z, r) plane over 2πr. There it is a mixture: each piece has its share of the
    points, its length and its thickness, and what is beyond all pieces is spread over the whole plane. Up to
    what is the same for all fits to the same points.
    """
    total = float(thick.counts.sum()) + thick.beyond
    some = thick.counts > 0.0
    share = thick.counts[some] / total
    area = np.maximum(thick.scales[some], fit.sigma) * fit.pieces.spacing
    spread = share @ (np.log(area) - np.log(share))
    if thick.beyond > 0.0:
        beyond = thick.beyond / total
        spread += beyond * (np.log(max(thick.plane, 1e-300)) - np.log(beyond))
    return float(spread + thick.log_radius)


def relative_scales(thick: Thickness, fit: Fit) -> Floats:
    """(K,) how much thicker than the noise of the fit each piece is; 1 up to :data:`THICKER`.

    A corner, where some points belong to the next piece, has inliers enough; a side of lugs has hardly any.
    """
    ratio = thick.scales / fit.sigma
    return np.where(ratio > THICKER, ratio, 1.0)
