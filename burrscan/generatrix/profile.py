"""A mesh seen along its axis: every vertex as (z, r, angle)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from burrscan.arrays import Floats, Ints32
from burrscan.axis.basis import T_part_mesh
from burrscan.inspection import Axis


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
    transform = T_part_mesh(axis.point_mm, axis.direction)
    return Profile(*_cylindrical(np.ascontiguousarray(vertices_mm, dtype=np.float64), transform))


def meridian_of(vertices_mm: Floats, axis: Axis) -> tuple[Floats, Floats]:
    """Position along ``axis`` and distance from it, (V,) each; :func:`profile_of` without the angle. O(V)."""
    transform = T_part_mesh(axis.point_mm, axis.direction)
    z, r = _meridian(np.ascontiguousarray(vertices_mm, dtype=np.float64), transform)
    return z, r


@njit(cache=True, nogil=True, error_model="numpy")
def _meridian(vertices: Floats, transform: Floats) -> tuple[Floats, Floats]:
    z, r = np.empty(len(vertices)), np.empty(len(vertices))
    for i in range(len(vertices)):
        a, b, c = vertices[i, 0], vertices[i, 1], vertices[i, 2]
        x = transform[0, 0] * a + transform[0, 1] * b + transform[0, 2] * c + transform[0, 3]
        y = transform[1, 0] * a + transform[1, 1] * b + transform[1, 2] * c + transform[1, 3]
        z[i] = transform[2, 0] * a + transform[2, 1] * b + transform[2, 2] * c + transform[2, 3]
        r[i] = np.sqrt(x * x + y * y)
    return z, r


@njit(cache=True, nogil=True, error_model="numpy")
def angle_of(y: float, x: float) -> float:
    """atan2 within two units in the last place, without branches: loops of it become vector instructions.

    Cephes' rational approximation of the arctangent up to tan 22.5° (Moshier, atan.c), the rest by symmetry.
    """
    a, b = abs(x), abs(y)
    big, small = max(a, b), min(a, b)
    beyond = small > 0.41421356237309503 * big
    above, below = (small - big if beyond else small), (small + big if beyond else big)
    q = above / below if below != 0.0 else 0.0
    s = q * q
    p = -8.750608600031904122785e-1 * s - 1.615753718733365076637e1
    p = ((p * s - 7.500855792314704667340e1) * s - 1.228866684490136173410e2) * s - 6.485021904942025371773e1
    w = ((s + 2.485846490142306297962e1) * s + 1.650270098316988542046e2) * s + 4.328810604912902668951e2
    w = (w * s + 4.853903996359136964868e2) * s + 1.945506571482613964425e2
    angle = q + q * (s * p / w)
    angle = angle + 0.25 * np.pi if beyond else angle
    angle = 0.5 * np.pi - angle if b > a else angle
    angle = np.pi - angle if x < 0.0 else angle
    return np.copysign(angle, y)  # type: ignore[no-any-return]


@njit(cache=True, nogil=True, error_model="numpy")
def _cylindrical(vertices: Floats, transform: Floats) -> tuple[Floats, Floats, Floats]:
    count = len(vertices)
    z, r, angle = np.empty(count), np.empty(count), np.empty(count)
    for i in range(count):
        a, b, c = vertices[i, 0], vertices[i, 1], vertices[i, 2]
        angle[i] = transform[0, 0] * a + transform[0, 1] * b + transform[0, 2] * c + transform[0, 3]
        r[i] = transform[1, 0] * a + transform[1, 1] * b + transform[1, 2] * c + transform[1, 3]
        z[i] = transform[2, 0] * a + transform[2, 1] * b + transform[2, 2] * c + transform[2, 3]
    for i in range(count):  # a second loop, for loops over one kind of stride become vector instructions
        x, y = angle[i], r[i]
        r[i], angle[i] = np.sqrt(x * x + y * y), angle_of(y, x)
    return z, r, angle


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
