"""The Cramér-Rao bound of an axis: what no unbiased estimator can beat."""

from __future__ import annotations

import numpy as np

from bench.synthetic.revolution import on_curve, profile_of, reached
from burrscan.arrays import Floats


def cramer_rao_covariance(
    profile: str | Floats = "stepped_wheel",
    *,
    arc_deg: float = 140.0,
    shape: tuple[int, int] = (484, 128),
    sigma_mm: float,
    known_generatrix: bool = False,
) -> Floats:
    """4×4 bound on (tilt about x, tilt about y in rad; offset x, y in mm at z = 0) in the part frame.

    The generatrix is free: one unknown per row of the grid, eliminated by centring the Jacobian per row.
    Where it is known, as from a drawing, only its place along the axis is free.
    """
    polyline = profile_of(profile)
    curve, normal = on_curve(polyline, np.linspace(0.0, reached(polyline)[-1], shape[1]))
    phi = np.radians(np.linspace(-arc_deg / 2, arc_deg / 2, shape[0]))
    free = 0.0 if known_generatrix else 1.0
    cosine, sine = (wave - free * wave.mean() for wave in (np.cos(phi), np.sin(phi)))
    lever = curve[:, 0] * normal[:, 1] - curve[:, 1] * normal[:, 0]
    columns = [
        -np.outer(lever, sine),
        np.outer(lever, cosine),
        np.outer(normal[:, 1], cosine),
        np.outer(normal[:, 1], sine),
    ]
    if known_generatrix and np.any(normal[:, 0]):  # a cylinder's place along its axis is nowhere seen
        columns.append(np.outer(normal[:, 0], np.ones_like(phi)))
    jacobian = np.stack(columns)
    information = np.einsum("ipq,jpq->ij", jacobian, jacobian)
    return sigma_mm**2 * np.linalg.inv(information)[:4, :4]


def cramer_rao_deg(
    profile: str | Floats = "stepped_wheel",
    *,
    arc_deg: float = 140.0,
    shape: tuple[int, int] = (484, 128),
    sigma_mm: float,
    known_generatrix: bool = False,
) -> float:
    """Bound on the direction: root of the sum of the two tilt variances, degrees."""
    covariance = cramer_rao_covariance(
        profile, arc_deg=arc_deg, shape=shape, sigma_mm=sigma_mm, known_generatrix=known_generatrix
    )
    return float(np.degrees(np.sqrt(covariance[0, 0] + covariance[1, 1])))
