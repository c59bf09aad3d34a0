"""Candidate axes from surfels: every direction of a grid, refined on the angle between normal and meridian.

The normals of a surface of revolution meet its axis (Pottmann & Randrup). For direction a and point c the
sine of the angle between the normal n at p and the meridian plane of p is n · (a × (p - c)) / |a × (p - c)|.
"""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats
from burrscan.axis.basis import perpendicular_basis
from burrscan.axis.jit import summing
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


@summing
def _point_on_axis(points: Floats, normals: Floats, weights: Floats, uv: Floats) -> tuple[float, float]:
    """The point nearest, in least absolute deviations, to the lines of the normals seen along an axis.

    ``uv`` (2, 3) are two unit vectors perpendicular to the axis; so are the coordinates.
    """
    u0, u1, u2, v0, v1, v2 = uv[0, 0], uv[0, 1], uv[0, 2], uv[1, 0], uv[1, 1], uv[1, 2]
    nus, nvs, levers = np.empty(len(points)), np.empty(len(points)), np.empty(len(points))
    for i in range(len(points)):
        nu = normals[i, 0] * u0 + normals[i, 1] * u1 + normals[i, 2] * u2
        nv = normals[i, 0] * v0 + normals[i, 1] * v1 + normals[i, 2] * v2
        u = points[i, 0] * u0 + points[i, 1] * u1 + points[i, 2] * u2
        v = points[i, 0] * v0 + points[i, 1] * v1 + points[i, 2] * v2
        nus[i], nvs[i], levers[i] = nu, nv, nu * v - nv * u
    cu, cv = 0.0, 0.0
    for turn in range(3):
        suu, suv, svv, bu, bv = 1e-9, 0.0, 1e-9, 0.0, 0.0
        for i in range(points.shape[0]):
            nu, nv, b = nus[i], nvs[i], levers[i]
            w = weights[i] / (abs(b - nu * cv + nv * cu) + 0.03 if turn > 0 else 1.0)
            suu += w * nv * nv
            suv -= w * nu * nv
            svv += w * nu * nu
            bu -= w * nv * b
            bv += w * nu * b
        det = suu * svv - suv * suv
        cu, cv = (svv * bu - suv * bv) / det, (suu * bv - suv * bu) / det
    return cu, cv


@summing
def angle_cost(points: Floats, normals: Floats, weights: Floats, a: Floats, c: Floats, width: float) -> float:
    """Geman-McClure mean of the angle between the normals and the meridian planes."""
    cost = 0.0
    a0, a1, a2 = a
    c0, c1, c2 = c
    for i in range(points.shape[0]):
        x, y, z = points[i, 0] - c0, points[i, 1] - c1, points[i, 2] - c2
        m0, m1, m2 = a1 * z - a2 * y, a2 * x - a0 * z, a0 * y - a1 * x
        s = m0 * normals[i, 0] + m1 * normals[i, 1] + m2 * normals[i, 2]
        e = s * s
        cost += weights[i] * e / (e + width * width * (m0 * m0 + m1 * m1 + m2 * m2 + 1e-12))
    return cost


@summing
def _normal_equations(
    points: Floats, normals: Floats, weights: Floats, a: Floats, c: Floats, uv: Floats, width: float
) -> tuple[Floats, Floats]:
    H = np.zeros((4, 4))
    g = np.zeros(4)
    J = np.zeros(4)
    a0, a1, a2 = a
    c0, c1, c2 = c
    for i in range(points.shape[0]):
        x, y, z = points[i, 0] - c0, points[i, 1] - c1, points[i, 2] - c2
        n0, n1, n2 = normals[i, 0], normals[i, 1], normals[i, 2]
        m0, m1, m2 = a1 * z - a2 * y, a2 * x - a0 * z, a0 * y - a1 * x
        length = np.sqrt(m0 * m0 + m1 * m1 + m2 * m2 + 1e-12)
        e = (m0 * n0 + m1 * n1 + m2 * n2) / length
        # h is the derivative of e by m = a × (p - c)
        h0, h1, h2 = (
            (n0 - e * m0 / length) / length,
            (n1 - e * m1 / length) / length,
            (n2 - e * m2 / length) / length,
        )
        for k in range(2):
            u0, u1, u2 = uv[k, 0], uv[k, 1], uv[k, 2]
            J[k] = u0 * (y * h2 - z * h1) + u1 * (z * h0 - x * h2) + u2 * (x * h1 - y * h0)
            J[2 + k] = -(u0 * (h1 * a2 - h2 * a1) + u1 * (h2 * a0 - h0 * a2) + u2 * (h0 * a1 - h1 * a0))
        w = weights[i] / (1.0 + (e / width) ** 2) ** 2
        for j in range(4):
            g[j] += w * e * J[j]
            for k in range(j, 4):
                H[j, k] += w * J[j] * J[k]
    for j in range(4):
        for k in range(j):
            H[j, k] = H[k, j]
    return H, g


def descend(
    points: Floats, normals: Floats, weights: Floats, a: Floats, c: Floats, width: float, rounds: int
) -> tuple[Floats, Floats, float]:
    """Levenberg-Marquardt on the Geman-McClure cost of the angle."""
    cost = angle_cost(points, normals, weights, a, c, width)
    damping = 1e-3
    for _ in range(rounds):
        uv = perpendicular_basis(a).T.copy()
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


def _placed(
    points: Floats, normals: Floats, weights: Floats, direction: Floats, width: float
) -> tuple[Floats, float]:
    """Where an axis of a direction lies, and its cost; infinite where that is too far off."""
    uv = perpendicular_basis(direction).T.copy()
    place = np.asarray(_point_on_axis(points, normals, weights, uv)) @ uv
    if not place @ place < FARTHEST * FARTHEST:
        return place, np.inf
    return place, angle_cost(points, normals, weights, direction, place, width)


def candidate_axes(
    surfels: Surfels, *, grid: int = 120, descents: int = 10, keep: int = 4
) -> tuple[list[tuple[Floats, Floats, float]], int]:
    """The best few distinct (direction, point, cost), best first; and the evaluations."""
    p, n, w = surfels.points, surfels.normals, surfels.weights
    few = max(1, len(w) // 400)
    sparse = p[::few].copy(), n[::few].copy(), w[::few].copy()
    directions = np.concatenate([np.eye(3), hemisphere(grid)])  # a long part's axis is nearly a principal one
    places, costs = zip(*(_placed(*sparse, direction, 2.0 * WIDTH) for direction in directions), strict=True)
    order = [k for k in np.argsort(costs, kind="stable")[:descents] if np.isfinite(costs[k])]
    order += [k for k in range(3) if k not in order and np.isfinite(costs[k])]
    found = [descend(*sparse, directions[k], places[k], 2.0 * WIDTH, 10) for k in order]
    near = [(a, c, cost) for a, c, cost in found if c @ c < (0.9 * FARTHEST) ** 2]
    found = sorted(near or found, key=lambda candidate: candidate[2])
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
