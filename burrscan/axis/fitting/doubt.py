"""How probable it is that the axis is grossly wrong: another one altogether, or more than a degree off.

Every start leads to a basin of the landscape, and its refined fit to a generatrix in which the points have a
density. Were they independent, N of them would make the likelier basin more probable by the N-th power of the
ratio of the densities. Where neighbours share their errors (a flute as wide as a tenth of the view is one
error, not a thousand), N is the number of points over what they share, as the covariance has it. What is
thicker than the points' noise is the part's shape, of which a view holds few independent errors: what a wrong
axis fits is shape as well, and no chance.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from burrscan.arrays import Floats
from burrscan.axis.fitting.fit import Fit
from burrscan.axis.fitting.starts import FARTHEST

ALIKE = float(np.cos(np.radians(3.0)))
"""Axes nearer than this are one."""
OFF = float(np.radians(1.0))
"""Tilt from which an axis is grossly off."""
SHAPES = 16.0
"""Independent errors of a part that is not all round: one for each 11° of the half that a view shows."""
TURNS = 256
"""Directions that a tilt is added up over; the sum over a whole turn converges exponentially."""
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


def gross_probability(own: float, rivals: Sequence[float], *, independent: float) -> float:
    """Probability that one of the rivals is the axis.

    Parameters
    ----------
    own, rivals
        Negative log likelihoods of a point (:func:`burrscan.axis.fitting.scales.unlikelihood`).
    independent
        Number of independent points.

    """
    if not np.isfinite(own):
        return 1.0
    apart = independent * (own - np.array(rivals, dtype=float))
    odds = np.exp(np.minimum(apart, SURE)).sum()
    return float(odds / (1.0 + odds))


def independent_errors(*, thickness: float, noise: float, points: float) -> float:
    """Independent errors behind a generatrix's thickness: noise of many points, shape of few.

    The degrees of freedom of a sum of two variances (Satterthwaite 1946).

    Parameters
    ----------
    thickness, noise
        Deviation about the generatrix, and what of it the noise of the points explains.
    points
        Number of independent points.

    """
    if thickness <= 0.0:
        return points
    noisy = min(noise / thickness, 1.0) ** 2
    return float(1.0 / (noisy**2 / max(points, 1.0) + (1.0 - noisy) ** 2 / SHAPES))


def off_probability(tilts: Floats, *, freedom: float) -> float:
    """Probability that two tilts together exceed :data:`OFF`.

    Parameters
    ----------
    tilts
        (2, 2) their covariance, radians².
    freedom
        Degrees of freedom that the covariance is known with: the tilts follow the bivariate t distribution,
        whose tail in every direction of the whitened plane is (1 + q² / ν)^(-ν/2).

    """
    variances = np.linalg.eigvalsh(tilts).clip(1e-300)
    turn = 2.0 * np.pi * (np.arange(TURNS) + 0.5) / TURNS
    along = variances[0] * np.cos(turn) ** 2 + variances[1] * np.sin(turn) ** 2
    return float(((1.0 + OFF**2 / (along * freedom)) ** (-0.5 * freedom)).mean())
