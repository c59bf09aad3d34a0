"""How probable it is that the axis is another one altogether.

Every start leads to a basin of the landscape, and its refined fit to a generatrix that is so and so thick.
Were errors of points independent and normal, N of them would make the basin of thickness t more likely than
that of t' by (t'/t)^N, the ratio of the likelihoods with the noise at its best (Wilks). Where neighbours
share their errors (a flute as wide as a tenth of the view is one error, not a thousand), N is the number of
points over what they share, as the covariance has it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from burrscan.axis.fitting.fit import Fit
from burrscan.axis.fitting.starts import FARTHEST

ALIKE = float(np.cos(np.radians(3.0)))
"""Axes nearer than this are one."""
SURE = 700.0
"""Logarithm of odds beyond which they are no longer told apart: the largest whose exponential is a number."""


def thickness(fit: Fit, total: float) -> float:
    """Noise about a fit's generatrix, per share of points that it explains; infinite if too far away."""
    if fit.place @ fit.place > FARTHEST**2 or fit.inliers <= 0.0:
        return np.inf
    return fit.sigma * total / fit.inliers


def others(fit: Fit, fits: Sequence[Fit], total: float) -> list[Fit]:
    """Of the fits those of another axis, each once, the thinnest first."""
    found: list[Fit] = []
    for rival in sorted(fits, key=lambda one: thickness(one, total)):
        apart = all(abs(rival.frame[:, 2] @ one.frame[:, 2]) < ALIKE for one in [fit, *found])
        if apart and np.isfinite(thickness(rival, total)):
            found.append(rival)
    return found


def gross_probability(fit: Fit, rivals: Sequence[Fit], *, total: float, independent: float) -> float:
    """Probability that one of the rivals is the axis.

    Parameters
    ----------
    fit, rivals
        Of the same ``total`` weight of points, at the same resolution.
    independent
        Number of independent points.

    """
    own = thickness(fit, total)
    if not np.isfinite(own):
        return 1.0
    ratios = np.array([own / max(thickness(rival, total), 1e-300) for rival in rivals])
    odds = np.exp(np.minimum(independent * np.log(np.maximum(ratios, 1e-300)), SURE)).sum()
    return float(odds / (1.0 + odds))
