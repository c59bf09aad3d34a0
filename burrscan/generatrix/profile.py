"""A mesh seen along its axis: every vertex as (z, r, angle)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from burrscan.arrays import Floats, Ints32
from burrscan.axis.basis import T_part_mesh
from burrscan.inspection import Axis
from burrscan.pose import placed


@dataclass(frozen=True)
class Profile:
    """Cylindrical coordinates about an axis: position along it, distance from it, angle in the part frame.

    Parameters
    ----------
    z_mm, r_mm, angle
        (V,) each; the angle in radians, atan2 in the xy plane of ``T_part_mesh``. NaN vertices stay NaN.

    """

    z_mm: Floats
    r_mm: Floats
    angle: Floats


def profile_of(vertices_mm: Floats, axis: Axis) -> Profile:
    """Cylindrical coordinates of (V, 3) vertices about ``axis``. O(V)."""
    x, y, z = placed(T_part_mesh(axis.point_mm, axis.direction), np.asarray(vertices_mm, np.float64)).T
    return Profile(z.copy(), np.hypot(x, y), np.arctan2(y, x))


def along_long_edges(profile: Profile, faces: Ints32, *, step_mm: float) -> Profile:
    """Add points along edges that are longer than ``step_mm`` in the (z, r) plane.

    A drawn cylinder has vertices at its two ends only; its straight edges are on the surface all the same. An
    edge whose chord sags below the surface by more than a tenth of a step is left alone. O(T + points added).
    """
    z, r, angle = _edge_points(profile.z_mm, profile.r_mm, profile.angle, faces, step_mm)
    if not len(z):
        return profile
    return Profile(
        np.concatenate([profile.z_mm, z]),
        np.concatenate([profile.r_mm, r]),
        np.concatenate([profile.angle, angle]),
    )


_MOST_POINTS_PER_EDGE = 256
"""Bounds the points on one edge of a drawing whose others are very short."""


@njit(cache=True, nogil=True, error_model="numpy")
def _edge_points(
    z: Floats, r: Floats, angle: Floats, faces: Ints32, step: float
) -> tuple[Floats, Floats, Floats]:
    new_z, new_r, new_angle = [0.0], [0.0], [0.0]
    for face in faces:
        for corner in range(3):
            i, j = face[corner], face[(corner + 1) % 3]
            dz, dr = z[j] - z[i], r[j] - r[i]
            length = np.sqrt(dz * dz + dr * dr)
            if not step < length < np.inf:
                continue
            xi, yi = r[i] * np.cos(angle[i]), r[i] * np.sin(angle[i])
            xj, yj = r[j] * np.cos(angle[j]), r[j] * np.sin(angle[j])
            middle = np.sqrt((xi + xj) ** 2 + (yi + yj) ** 2) / 2.0
            if (0.5 * (r[i] + r[j]) - middle) * abs(dz) / length > 0.1 * step:
                continue
            parts = min(int(length / step) + 1, _MOST_POINTS_PER_EDGE)
            for part in range(1, parts):
                t = part / parts
                x, y = xi + t * (xj - xi), yi + t * (yj - yi)
                new_z.append(z[i] + t * dz)
                new_r.append(np.sqrt(x * x + y * y))
                new_angle.append(np.arctan2(y, x))
    return np.array(new_z[1:]), np.array(new_r[1:]), np.array(new_angle[1:])
