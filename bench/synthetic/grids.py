"""Partial scans whose grid of vertices stands at any angle to the axis, and so to the burrs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from bench.synthetic.revolution import (
    RevolutionScan,
    RidgeBurr,
    grid_faces,
    profile_of,
    random_pose,
)
from burrscan.arrays import Bools, Floats, Ints32
from burrscan.pose import placed

MIDDLE_RADIUS_MM = 90.0
"""Where a step of the grid around is as long as one along the curve."""
SPACING_MM = 0.5226
"""122,682 triangles over 140 degrees of the stepped wheel."""


@dataclass(frozen=True)
class Disturbance:
    """What the noise is made of.

    Parameters
    ----------
    sigma_mm
        Its standard deviation along the normal.
    correlated
        Whether it is averaged over 3 rows and 3 columns of the grid first.
    outlier_share
        Share of vertices that are off by up to 20 mm.

    """

    sigma_mm: float
    correlated: bool = False
    outlier_share: float = 0.0


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
    polyline = profile_of(profile) if isinstance(profile, str) else profile
    length = float(np.hypot(*np.diff(polyline, axis=0).T).sum())
    extent = (np.radians(arc_deg) * MIDDLE_RADIUS_MM, length)
    around, along, shape = _grid(extent, np.radians(turn_deg), spacing_mm, rng)
    inside = (np.abs(around) <= extent[0] / 2.0) & (np.abs(along) <= extent[1] / 2.0)
    phi = around[inside] / MIDDLE_RADIUS_MM
    curve, normal = _on_curve(polyline, along[inside] + extent[1] / 2.0)
    lift = _noise(shape, noise, rng)[inside]
    for burr in burrs:
        lift += burr.height_at(curve[:, 0], phi)
    z, r = (curve + lift[:, None] * normal).T
    points = np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1)
    pose = random_pose(rng)
    vertices = placed(pose, points)
    return RevolutionScan(vertices, _faces(inside), pose[:3, 3], pose[:3, 2], pose, noise.sigma_mm)


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


def _on_curve(polyline: Floats, along: Floats) -> tuple[Floats, Floats]:
    """Places (z, r) at arc lengths along a polyline, and unit normals."""
    step = np.diff(polyline, axis=0)
    length = np.hypot(*step.T)
    start = np.concatenate([[0.0], np.cumsum(length)])
    k = np.clip(np.searchsorted(start, along, side="right") - 1, 0, len(step) - 1)
    tangent = step[k] / length[k, None]
    places = polyline[k] + tangent * (along - start[k])[:, None]
    return places, np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)


def _noise(shape: tuple[int, int], noise: Disturbance, rng: np.random.Generator) -> Floats:
    lift = rng.normal(size=shape)
    if noise.correlated:
        lift = 3.0 * ndimage.uniform_filter(lift, 3, mode="wrap")
    lift *= noise.sigma_mm
    outlier = rng.random(shape) < noise.outlier_share
    lift[outlier] += rng.uniform(-20.0, 20.0, int(outlier.sum()))
    return np.asarray(lift)


def _faces(inside: Bools) -> Ints32:
    """Triangles of the grid all of whose corners are inside, corners numbered among those inside."""
    number = (np.cumsum(inside.ravel()) - 1).astype(np.int32)
    faces = grid_faces(*inside.shape)
    whole = inside.ravel()[faces].all(axis=1)
    return np.asarray(number[faces[whole]], dtype=np.int32)
