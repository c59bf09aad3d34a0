"""How far errors of neighbouring points reach, read off the residuals themselves.

Where noise is blurred by a decoding window or by smoothing, points close to each other err alike. Products of
residuals of cells a few millimetres apart say how much they share and over which distance, each from tens of
thousands of pairs (a correlogram: Cressie 1993, section 2.4). What reaches over a good part of the view the
fit itself has followed, and few sectors are left to tell: that is weighed in
:mod:`burrscan.axis.fitting.correlation`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from burrscan.arrays import Floats

REACHES = 0.0125 * 2.0 ** (0.25 * np.arange(19))
"""Of the correlation (sigma of a Gaussian), in rms radii: from a cell of the map to a quarter of a radius."""
LAGS_ALONG = (1, 2, 3, 4, 6)
"""Cells along a piece of the generatrix."""
LAGS_AROUND = (1, 2, 3, 4)
"""Sectors: at more what the fit has followed outweighs what it has left."""
LEAST_LEFT = 0.1
"""Of the variance of errors that reach far: where the fit leaves less, what is left tells too little."""
SURE = 3.0
"""Standard errors from which errors are called shared; below it they are each point's own."""


class Correlation(NamedTuple):
    """What neighbours share.

    Parameters
    ----------
    share
        Variance of what is shared, of that of a residual: above 1 where the fit has followed most of it.
    reach
        Sigma of the Gaussian that it falls off by, in rms radii.
    own
        Variance of what is each point's own, of the variance of a residual.

    """

    share: float
    reach: float
    own: float


NONE = Correlation(0.0, float(REACHES[0]), 1.0)
"""Every point errs for itself."""


def alike(squares: Floats, reach: float, width: float) -> Floats:
    """Correlation of the means over two cells ``width`` wide, by the square of what their middles are apart.

    The uniform distribution over a cell is held to be a Gaussian of the same variance.
    """
    variance = reach**2 + width**2 / 6.0
    return np.asarray(reach / np.sqrt(variance) * np.exp(-0.5 * squares / variance))


def correlation_of(counts: Floats, sums: Floats, *, radius: float, along: float) -> Correlation:
    """The share and the reach that fit the products of residuals best (weighted least squares).

    O(K U S) for each lag.

    Parameters
    ----------
    counts, sums
        (K, U, S) points of each cell: K pieces, U places along it, S sectors of a whole turn; and the sums of
        their residuals, less the mean of the parallel, in standard deviations of a point.
    radius, along
        Of the cells, typical; and what they measure along the generatrix. In rms radii.

    """
    if not counts.any():
        return NONE
    products = [(sums**2).sum() - counts.sum()]
    pairs = [(counts * counts - counts).clip(0.0).sum()]
    for lag in LAGS_ALONG:
        products.append((sums[:, :-lag] * sums[:, lag:]).sum())
        pairs.append((counts[:, :-lag] * counts[:, lag:]).sum())
    for lag in LAGS_AROUND:
        products.append((sums * np.roll(sums, -lag, axis=2)).sum())
        pairs.append((counts * np.roll(counts, -lag, axis=2)).sum())
    number, product = np.array(pairs), np.array(products)
    arc = _Arc(counts.sum(axis=(0, 1)), radius)
    best, least = NONE, np.inf
    for reach in REACHES:
        expected = arc.expected(float(reach), along)
        left, told = float(expected[0]), float(expected**2 @ number)
        most = 1.0 / max(left, LEAST_LEFT)
        share = min(max(float(expected @ product) / max(told, 1e-300), 0.0), most)
        misfit = float(((product - share * expected * number) ** 2 / np.maximum(number, 1.0)).sum())
        if misfit < least:
            shared = Correlation(share, float(reach), max(1.0 - share * left, 0.0))
            least, best = misfit, shared if share * np.sqrt(told) >= SURE else NONE
    return best


class _Arc:
    """What is left of correlated errors once the fit has followed a mean and one wave round the part.

    The mean is the generatrix's; the wave is what a tilt or an offset of the axis does to a parallel.
    """

    def __init__(self, seen: Floats, radius: float) -> None:
        """Of the points of each sector, (S,), at a distance from the axis."""
        turn = 2.0 * np.pi * np.arange(len(seen)) / len(seen)
        self._width = radius * turn[1]
        self._squares = (2.0 * radius * np.sin(0.5 * (turn[:, None] - turn))) ** 2
        followed = np.column_stack([np.ones_like(turn), np.cos(turn), np.sin(turn)])
        normal = np.linalg.pinv(followed.T @ (seen[:, None] * followed))
        self._left = np.eye(len(seen)) - followed @ normal @ (followed.T * seen)
        pairs, at = np.outer(seen, seen), np.arange(len(seen))
        self._beside = [(at, (at + lag) % len(seen)) for lag in (0, *LAGS_AROUND)]
        self._weights = [pairs[one] / max(float(pairs[one].sum()), 1e-300) for one in self._beside]

    def expected(self, reach: float, along: float) -> Floats:
        """Correlation of cells at each lag, first along the generatrix, then around."""
        around = self._left @ alike(self._squares, reach, self._width) @ self._left.T
        here, *beside = (
            float(weight @ around[one]) for weight, one in zip(self._weights, self._beside, strict=True)
        )
        up = alike((np.array([0, *LAGS_ALONG]) * along) ** 2, reach, along)
        return np.append(here * up, np.array(beside) * up[0])
