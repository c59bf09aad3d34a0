"""Line complexes: the normals of a surface of revolution meet its axis.

H. Pottmann, T. Randrup, "Rotational and helical surface approximation for reverse engineering", Computing 60
(1998) 307-322; H. Pottmann, I.-K. Lee, T. Randrup, "Reconstruction of kinematic surfaces from scattered
data", Symposium on Geodesy for Geotechnical and Structural
Engineering, 1998, 483-488 (the seed's reference 5).
"""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats, Ints32
from burrscan.axis.points.surfels import Surfels
from burrscan.axis.rivals.common import bare_axis, patches
from burrscan.inspection import Axis
from burrscan.robust import SIGMA_PER_MEDIAN

ROUNDS = 20
"""Of reweighting; the weights settle geometrically, and a round costs one pass over the patches."""


def find_axis_line_complex(
    vertices_mm: Floats,
    faces: Ints32 | None,  # noqa: ARG001
    *,
    sigma_mm: Floats | None = None,
    seed: int = 0,  # noqa: ARG001
) -> Axis:
    """Least squares, every patch alike. O(V)."""
    cloud, surfels = patches(vertices_mm, sigma_mm)
    direction, place = fit_complex(surfels, np.ones(len(surfels.weights)))
    return bare_axis(cloud, direction, place, "line-complex", 1)


def find_axis_line_complex_robust(
    vertices_mm: Floats,
    faces: Ints32 | None,  # noqa: ARG001
    *,
    sigma_mm: Floats | None = None,
    seed: int = 0,  # noqa: ARG001
) -> Axis:
    """The same, reweighted by flatness and by each normal's angle (Geman-McClure). O(V)."""
    cloud, surfels = patches(vertices_mm, sigma_mm)
    weights = surfels.weights
    for _ in range(ROUNDS):
        direction, place = fit_complex(surfels, weights)
        moment = np.cross(direction, surfels.points - place)
        distance = np.maximum(np.linalg.norm(moment, axis=1), 1e-6)
        sine = np.einsum("ij,ij->i", moment, surfels.normals) / distance
        scale = max(SIGMA_PER_MEDIAN * float(np.median(np.abs(sine))), 1e-6)
        # dividing by the distance takes off the bias towards axes inside the patch
        weights = surfels.weights / (1.0 + (sine / (2.0 * scale)) ** 2) ** 2 / distance**2
    return bare_axis(cloud, direction, place, "line-complex-robust", ROUNDS)


def fit_complex(surfels: Surfels, weights: Floats) -> tuple[Floats, Floats]:
    """Direction and point that minimise Σ w (a · (q × n) + c̄ · n)² with |a| = 1, then c̄ ⊥ a."""
    rows = np.hstack([np.cross(surfels.points, surfels.normals), surfels.normals])
    M = (rows * weights[:, None]).T @ rows
    A, B, D = M[:3, :3], M[:3, 3:], M[3:, 3:]
    solved = np.linalg.solve(D + 1e-12 * np.trace(D) * np.eye(3), B.T)
    direction: Floats = np.linalg.eigh(A - B @ solved)[1][:, 0]
    moment = -solved @ direction
    moment -= direction * (direction @ moment)
    return direction, np.cross(direction, moment)
