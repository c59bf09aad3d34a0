"""The Cramér-Rao bound of an axis: what no unbiased estimator can beat."""

from __future__ import annotations

import numpy as np

from bench.axis.revolution import profile_of, sampled_profile
from burrscan.arrays import Floats


def cramer_rao_covariance(
    profile: str | Floats = "stepped_wheel",
    *,
    arc_deg: float = 140.0,
    shape: tuple[int, int] = (484, 128),
    sigma_mm: float,
) -> Floats:
    """4×4 bound on (tilt about x, tilt about y in rad; offset x, y in mm at z = 0) in the part frame.

    The generatrix is free: one unknown per row of the grid, eliminated by centring the Jacobian per row.
    """
    polyline = profile_of(profile) if isinstance(profile, str) else profile
    curve, normal = sampled_profile(polyline, shape[1])
    phi = np.radians(np.linspace(-arc_deg / 2, arc_deg / 2, shape[0]))
    cosine, sine = np.cos(phi) - np.cos(phi).mean(), np.sin(phi) - np.sin(phi).mean()
    lever = curve[:, 0] * normal[:, 1] - curve[:, 1] * normal[:, 0]
    jacobian = np.stack(
        [
            -np.outer(lever, sine),
            np.outer(lever, cosine),
            np.outer(normal[:, 1], cosine),
            np.outer(normal[:, 1], sine),
        ]
    )
    return sigma_mm**2 * np.linalg.inv(np.einsum("ipq,jpq->ij", jacobian, jacobian))


def cramer_rao_deg(
    profile: str | Floats = "stepped_wheel",
    *,
    arc_deg: float = 140.0,
    shape: tuple[int, int] = (484, 128),
    sigma_mm: float,
) -> float:
    """Bound on the direction: root of the sum of the two tilt variances, degrees."""
    covariance = cramer_rao_covariance(profile, arc_deg=arc_deg, shape=shape, sigma_mm=sigma_mm)
    return float(np.degrees(np.sqrt(covariance[0, 0] + covariance[1, 1])))
