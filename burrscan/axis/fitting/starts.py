"""Candidate axes from surfels: every direction of a grid, refined on the angle between normal and meridian.

The normals of a surface of revolution meet its axis (Pottmann & Randrup). For direction a and point c the
sine of the angle between the normal n at p and the meridian plane of p is n · (a × (p - c)) / |a × (p - c)|.
"""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats
from burrscan.axis.basis import perpendicular_basis
from burrscan.axis.points.surfels import Surfels

WIDTH = 0.08
"""Angle, in radians, at which a normal counts half (Geman & McClure)."""
FARTHEST = 8.0
"""An axis further than this many rms radii is none: a turn about it is a shift along a prism."""


def hemisphere(count: int) -> Floats:
    """``count`` directions spread evenly over half the sphere (Fibonacci spiral)."""
    z = (np.arange(count) + 0.5) / count
    turn = np.arange(count) * np.pi * (3.0 - np.sqrt(5.0))
    r = np.sqrt(1.0 - z * z)
    return np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1)


def _points_on_axes(points: Floats, normals: Floats, weights: Floats, across: Floats) -> Floats:
    """(D, 3) points nearest, in least absolute deviations, to the lines of the normals seen along D axes.

    ``across`` (D, 2, 3) are two unit vectors perpendicular to each axis.
    """
    nu, nv = np.einsum("dki,vi->kdv", across, normals)
    u, v = np.einsum("dki,vi->kdv", across, points)
    lever, w = nu * v - nv * u, weights
    for _ in range(3):
        suu, suv, svv = (
            (w * nv * nv).sum(axis=1) + 1e-9,
            -(w * nu * nv).sum(axis=1),
            (w * nu * nu).sum(axis=1),
        )
        bu, bv, svv = -(w * nv * lever).sum(axis=1), (w * nu * lever).sum(axis=1), svv + 1e-9
        det = suu * svv - suv * suv
        cu, cv = (svv * bu - suv * bv) / det, (suu * bv - suv * bu) / det
        w = weights / (np.abs(lever - nu * cv[:, None] + nv * cu[:, None]) + 0.03)
    return np.asarray(cu[:, None] * across[:, 0] + cv[:, None] * across[:, 1])


def angle_cost(points: Floats, normals: Floats, weights: Floats, a: Floats, c: Floats, width: float) -> float:
    """Geman-McClure mean of the angle between the normals and the meridian planes."""
    x, y, z = _cross(a, (points - c).T)
    square = (x * normals[:, 0] + y * normals[:, 1] + z * normals[:, 2]) ** 2
    return float((weights * square / (square + width**2 * (x * x + y * y + z * z + 1e-12))).sum())


def _cross(a: Floats, b: Floats) -> tuple[Floats, Floats, Floats]:
    """Components of the product a × b of (3,) or (3, V); np.cross takes three times as long."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _normal_equations(
    points: Floats, normals: Floats, weights: Floats, a: Floats, c: Floats, uv: Floats, width: float
) -> tuple[Floats, Floats]:
    arm, across = (points - c).T, normals.T
    lever = np.stack(_cross(a, arm))
    length = np.sqrt((lever**2).sum(axis=0) + 1e-12)
    e = (lever * across).sum(axis=0) / length
    by_lever = (across - e * lever / length) / length
    J = np.hstack([np.stack(_cross(by, by_lever), axis=1) @ uv.T for by in (arm, a)])
    weighted = J * (weights / (1.0 + (e / width) ** 2) ** 2)[:, None]
    # no BLAS: the same bits on any number of cores
    return np.einsum("vi,vj->ij", weighted, J), np.einsum("vi,v->i", weighted, e)


def descend(
    points: Floats, normals: Floats, weights: Floats, a: Floats, c: Floats, width: float, rounds: int
) -> tuple[Floats, Floats, float]:
    """Levenberg-Marquardt on the Geman-McClure cost of the angle."""
    cost = angle_cost(points, normals, weights, a, c, width)
    damping = 1e-3
    for _ in range(rounds):
        uv = perpendicular_basis(a).T
        H, g = _normal_equations(points, normals, weights, a, c, uv, width)
        step = -np.linalg.solve(H + np.diag(damping * np.diag(H) + 1e-12), g)
        b = a + step[:2] @ uv
        b /= np.sqrt(b @ b)
        d = c + step[2:] @ uv
        d -= (d @ b) * b
        fresh = angle_cost(points, normals, weights, b, d, width)
        if fresh < cost and d @ d < FARTHEST * FARTHEST:
            settled = cost - fresh < 1e-5 * cost
            a, c, cost, damping = b, d, fresh, damping * 0.1
            if settled:
                break
        else:
            damping *= 10.0
            if damping > 1e3:
                break
    return a, c, cost


def candidate_axes(
    surfels: Surfels, *, grid: int = 120, descents: int = 10, keep: int = 4
) -> tuple[list[tuple[Floats, Floats, float]], int]:
    """The best few distinct (direction, point, cost), best first; and the evaluations."""
    p, n, w = surfels.points, surfels.normals, surfels.weights
    few = max(1, len(w) // 400)
    sparse = p[::few].copy(), n[::few].copy(), w[::few].copy()
    directions = np.concatenate([np.eye(3), hemisphere(grid)])  # a long part's axis is nearly a principal one
    places = _points_on_axes(*sparse, np.array([perpendicular_basis(one).T for one in directions]))
    near = (places**2).sum(axis=1) < FARTHEST**2
    costs = [
        angle_cost(*sparse, direction, place, 2.0 * WIDTH) if close else np.inf
        for direction, place, close in zip(directions, places, near, strict=True)
    ]
    order = [k for k in np.argsort(costs, kind="stable")[:descents] if np.isfinite(costs[k])]
    order += [k for k in range(3) if k not in order and np.isfinite(costs[k])]
    found = [descend(*sparse, directions[k], places[k], 2.0 * WIDTH, 10) for k in order]
    within = [(a, c, cost) for a, c, cost in found if c @ c < (0.9 * FARTHEST) ** 2]
    found = sorted(within or found, key=lambda candidate: candidate[2])
    best = [descend(p, n, w, a, c, WIDTH, 10) for a, c, _ in _distinct(found)[:keep]]
    best.sort(key=lambda candidate: candidate[2])
    return _distinct(best), len(directions) + len(order) + len(best)


def _distinct(candidates: list[tuple[Floats, Floats, float]]) -> list[tuple[Floats, Floats, float]]:
    """The candidates no better one of which points within 3 degrees of them."""
    kept: list[tuple[Floats, Floats, float]] = []
    for candidate in candidates:
        if all(abs(candidate[0] @ other[0]) < np.cos(np.radians(3.0)) for other in kept):
            kept.append(candidate)
    return kept
