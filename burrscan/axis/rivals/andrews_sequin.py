"""Slippage with Taubin's normalisation: a velocity field tangential to the surface.

J. Andrews, C. H. Séquin, "Generalized, basis-independent kinematic surface fitting", Computer-Aided Design 45
(2013) 615-620 (pages from memory): minimise Σ (v · n)² / Σ |v|² with v = c̄ + a × p, which takes most of the
line complex's bias.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh

from burrscan.arrays import Floats, Ints32
from burrscan.axis.rivals.common import bare_axis, patches
from burrscan.inspection import Axis

ALIKE = 4.0
"""Two eigenvalues within this ratio span one motion: a cylinder both turns and slides in itself."""


def find_axis_andrews_sequin(
    vertices_mm: Floats,
    faces: Ints32 | None,  # noqa: ARG001
    *,
    sigma_mm: Floats | None = None,
    seed: int = 0,  # noqa: ARG001
) -> Axis:
    """Solve the generalised eigenproblem once. O(V)."""
    cloud, surfels = patches(vertices_mm, sigma_mm)
    p, n, w = surfels.points, surfels.normals, surfels.weights
    rows = np.hstack([np.cross(p, n), n])
    M = (rows * w[:, None]).T @ rows
    N = _speed(p, w)
    values, vectors = eigh(M, N + 1e-12 * np.trace(N) * np.eye(6))
    motion = _pure_turn(values, vectors)
    direction = motion[:3] / np.linalg.norm(motion[:3])
    moment = motion[3:] / np.linalg.norm(motion[:3])
    moment -= direction * (direction @ moment)
    return bare_axis(cloud, direction, np.cross(direction, moment), "andrews-sequin", 1)


def _speed(p: Floats, w: Floats) -> Floats:
    """6×6 quadratic form of Σ w |c̄ + a × p|² in (a, c̄)."""
    second = np.einsum("i,ij,ik->jk", w, p, p)
    x, y, z = w @ p
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    N = np.zeros((6, 6))
    N[:3, :3] = np.trace(second) * np.eye(3) - second
    N[:3, 3:], N[3:, :3] = cross, cross.T
    N[3:, 3:] = w.sum() * np.eye(3)
    return N


def _pure_turn(values: Floats, vectors: Floats) -> Floats:
    """The motion without slide in the space of the least eigenvalues."""
    first, second = vectors[:, 0], vectors[:, 1]
    if values[1] > ALIKE * max(values[0], 1e-300):
        return first if np.linalg.norm(first[:3]) > 1e-3 * np.linalg.norm(first) else second
    # a · c̄ of cos(t) first + sin(t) second: zero for a pure turn or a pure shift
    best = first
    for t in np.linspace(0.0, np.pi, 720, endpoint=False):
        motion = np.cos(t) * first + np.sin(t) * second
        if _slide(motion) < _slide(best):
            best = motion
    return best


def _slide(motion: Floats) -> float:
    turn = max(float(motion[:3] @ motion[:3]), 1e-12)
    return abs(float(motion[:3] @ motion[3:])) / turn
