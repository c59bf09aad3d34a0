"""The Cramér-Rao bound of a burr's height and angle, its kind of cross-section known."""

from __future__ import annotations

import numpy as np

from bench.synthetic.revolution import RidgeBurr
from burrscan.arrays import Floats
from burrscan.turns import turn_deg


def cramer_rao(place: Floats, burr: RidgeBurr, *, sigma_mm: float) -> tuple[float, float]:
    """Bound of height, mm, and angle, degrees, of a triangular ridge of unknown height, place, slant, width.

    Parameters
    ----------
    place
        (N, 2) z (mm) and angle (radians) of the vertices.
    burr
        The true burr; the surface beneath it and its ends are taken as known.
    sigma_mm
        Noise along the normal.

    Returns
    -------
    tuple
        Two standard deviations; infinite where the vertices leave height, angle and width open, as two rows
        of vertices across do.

    """
    z, phi = place.T
    near = np.abs(turn_deg(np.degrees(phi) - burr.angle_deg)) < burr.width_deg
    z, x = z[near], np.degrees(phi[near]) - burr.angle_deg
    half = burr.width_deg / 2.0
    inside = (np.abs(x) < half) & (z >= burr.z_start_mm) & (z <= burr.z_end_mm)
    z, x = z[inside], x[inside]
    slope = burr.height_mm / half * np.sign(x)
    jacobian = np.stack(
        [1.0 - np.abs(x) / half, slope, slope * z, burr.height_mm * np.abs(x) / half**2], axis=1
    )
    scale = np.linalg.norm(jacobian, axis=0)
    if not (scale > 0.0).all() or np.linalg.cond(jacobian / scale) > 1e5:
        return float("inf"), float("inf")
    covariance = sigma_mm**2 * np.linalg.inv(jacobian.T @ jacobian)
    return float(np.sqrt(covariance[0, 0])), float(np.sqrt(covariance[1, 1]))
