"""Partial scans whose grid of vertices stands at any angle to the axis, and so to the burrs."""

from __future__ import annotations

import numpy as np

from bench.synthetic.revolution import (
    Disturbance,
    RevolutionScan,
    RidgeBurr,
    grid_faces,
    lifted,
    profile_of,
    random_pose,
    reached,
)
from burrscan.arrays import Bools, Floats, Ints32
from burrscan.pose import placed

MIDDLE_RADIUS_MM = 90.0
"""Where a step of the grid around is as long as one along the curve."""
SPACING_MM = 0.5226
"""122,682 triangles over 140 degrees of the stepped wheel."""


def grid_scan(
    profile: str | Floats = "stepped_wheel",
    *,
    turn_deg: float,
    noise: Disturbance,
    seed: int | tuple[int, ...],
    arc_deg: float = 140.0,
    burrs: tuple[RidgeBurr, ...] = (),
    spacing_mm: float = SPACING_MM,
) -> RevolutionScan:
    """A square grid of vertices laid on the unrolled surface at ``turn_deg`` to the axis, in a random pose.

    At 0 degrees every row of vertices meets a burr along the axis at the same places across it.
    """
    rng = np.random.default_rng(seed)
    polyline = profile_of(profile)
    extent = (np.radians(arc_deg) * MIDDLE_RADIUS_MM, reached(polyline)[-1])
    around, along, shape = _grid(extent, np.radians(turn_deg), spacing_mm, rng)
    inside = (np.abs(around) <= extent[0] / 2.0) & (np.abs(along) <= extent[1] / 2.0)
    lift = noise.drawn(shape, rng)[inside]
    phi = around[inside] / MIDDLE_RADIUS_MM
    points = lifted(polyline, along[inside] + extent[1] / 2.0, phi, lift, burrs)
    pose = random_pose(rng)
    return RevolutionScan(placed(pose, points), _faces(inside), pose, noise.sigma_mm)


def _grid(
    extent: tuple[float, float], turn: float, spacing: float, rng: np.random.Generator
) -> tuple[Floats, Floats, tuple[int, int]]:
    """Places (around, along) of a turned grid that covers the extent, its origin anywhere within a cell."""
    reach = [
        0.5 * (extent[0] * abs(np.cos(turn)) + extent[1] * abs(np.sin(turn))),
        0.5 * (extent[0] * abs(np.sin(turn)) + extent[1] * abs(np.cos(turn))),
    ]
    i, j = (np.arange(-np.ceil(r / spacing), np.ceil(r / spacing) + 1) for r in reach)
    a, b = np.meshgrid((i + rng.random()) * spacing, (j + rng.random()) * spacing, indexing="ij")
    return a * np.cos(turn) - b * np.sin(turn), a * np.sin(turn) + b * np.cos(turn), a.shape


def _faces(inside: Bools) -> Ints32:
    """Triangles of the grid all of whose corners are inside, corners numbered among those inside."""
    number = (np.cumsum(inside.ravel()) - 1).astype(np.int32)
    faces = grid_faces(*inside.shape)
    whole = inside.ravel()[faces].all(axis=1)
    return np.asarray(number[faces[whole]], dtype=np.int32)
