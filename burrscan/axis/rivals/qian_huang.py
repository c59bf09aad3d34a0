"""Uniform search over directions for planar sections of constant curvature.

X. Qian, X. Huang, "Reconstruction of surfaces of revolution with partial sampling", Journal of Computational
and Applied Mathematics 163 (2004) 211-217 (as the seed cites it, reference 14). Curvature is the difference
of normals along a section over the distance of their points. A circle cut askew by an angle α is an ellipse
whose curvature varies by 3/2 α² only: the direction is found to degrees, on a short arc to more.
"""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats, Ints32
from burrscan.axis.fitting.starts import hemisphere
from burrscan.axis.points.surfels import Surfels
from burrscan.axis.rivals.common import bare_axis, patches
from burrscan.inspection import Axis

LEAST = 6
"""Patches a section needs."""


def find_axis_qian_huang(
    vertices_mm: Floats,
    faces: Ints32 | None,  # noqa: ARG001
    *,
    sigma_mm: Floats | None = None,
    seed: int = 0,  # noqa: ARG001
    directions: int = 400,
    sections: int = 12,
    zooms: int = 4,
) -> Axis:
    """Try directions over a hemisphere, then ever denser around the best.

    Parameters
    ----------
    directions
        Of the uniform search.
    sections
        Slabs across each direction.
    zooms
        Refinements of the search, each four times as fine.

    """
    cloud, surfels = patches(vertices_mm, sigma_mm)
    grid = hemisphere(directions)
    spread = float(np.sqrt(2.0 * np.pi / directions))
    evaluations = 0
    for _ in range(zooms + 1):
        results = [section_curvature(surfels, direction, sections) for direction in grid]
        evaluations += len(grid)
        k = int(np.argmin([cost for cost, _ in results]))
        best, place = grid[k], results[k][1]
        grid = _around(best, spread)
        spread /= 4.0
    return bare_axis(cloud, best, place, "qian-huang", evaluations)


def _around(direction: Floats, spread: float) -> Floats:
    """A 7 × 7 patch of directions."""
    start = np.eye(3)[np.argmin(np.abs(direction))]
    u = np.cross(start, direction)
    u /= np.linalg.norm(u)
    v = np.cross(direction, u)
    s = np.linspace(-spread, spread, 7)
    trials = np.array([direction + a * u + b * v for a in s for b in s])
    return np.asarray(trials / np.linalg.norm(trials, axis=1)[:, None])


def section_curvature(surfels: Surfels, direction: Floats, sections: int) -> tuple[float, Floats]:
    """Mean relative spread of the curvature within the sections, and the median centre of curvature."""
    start = np.eye(3)[np.argmin(np.abs(direction))]
    u = np.cross(start, direction)
    u /= np.linalg.norm(u)
    v = np.cross(direction, u)
    flat = np.stack(
        [surfels.points @ u, surfels.points @ v, surfels.normals @ u, surfels.normals @ v], axis=1
    )
    length = np.hypot(flat[:, 2], flat[:, 3])
    height = surfels.points @ direction
    layer = np.minimum(((height - height.min()) / np.ptp(height) * sections).astype(np.int64), sections - 1)
    spreads, masses, centres = [], [], []
    for k in range(sections):
        inside = (layer == k) & (length > 0.3)
        if inside.sum() < LEAST:
            continue
        curvature, centre = _curvatures(flat[inside], length[inside])
        middle = float(np.median(curvature))
        spreads.append(float(np.median(np.abs(curvature - middle))) / max(middle, 1e-9))
        masses.append(int(inside.sum()))
        centres.append(centre)
    if not spreads or sum(masses) < 0.3 * len(height):
        return np.inf, np.zeros(3)
    centre = np.median(centres, axis=0)
    return float(np.average(spreads, weights=masses)), centre[0] * u + centre[1] * v


def _curvatures(flat: Floats, length: Floats) -> tuple[Floats, Floats]:
    """Curvature between points around the section, and the middle of the section's circle.

    Patches of a slab lie at several heights, so that neighbours may be nearer than their normals tell: points
    an eighth of the section apart are compared.
    """
    p, n = flat[:, :2], flat[:, 2:] / length[:, None]
    # the point nearest to the lines of all normals
    across = np.stack([-n[:, 1], n[:, 0]], axis=1)
    S = across.T @ across + 1e-9 * np.eye(2)
    centre = np.linalg.solve(S, across.T @ np.einsum("ij,ij->i", across, p))
    out = p - centre
    order = np.argsort(np.arctan2(out[:, 1], out[:, 0]))
    p, n, out = p[order], n[order], out[order]
    n = n * np.where(np.einsum("ij,ij->i", n, out) < 0.0, -1.0, 1.0)[:, None]
    apart = max(len(p) // 8, 1)
    gap = np.maximum(np.linalg.norm(p[apart:] - p[:-apart], axis=1), 1e-6)
    return np.linalg.norm(n[apart:] - n[:-apart], axis=1) / gap, centre
