"""The one choice of basis perpendicular to an axis, shared by everything that states tilts and offsets."""

from __future__ import annotations

import math

import numpy as np

from burrscan.arrays import Floats


def perpendicular_basis(direction: Floats) -> Floats:
    """Two unit vectors perpendicular to ``direction``, as the columns of a (3, 2) array.

    ``(e1, e2, direction)`` is right-handed; e1 is the coordinate axis least aligned with the direction, made
    perpendicular to it.
    """
    start = np.zeros(3)
    start[np.argmin(np.abs(direction))] = 1.0
    a, b, c = start - direction * (start @ direction)
    length = math.sqrt(a * a + b * b + c * c)
    a, b, c = a / length, b / length, c / length
    x, y, z = direction
    return np.array([[a, y * c - z * b], [b, z * a - x * c], [c, x * b - y * a]])


def T_part_mesh(point_mm: Floats, direction: Floats) -> Floats:  # noqa: N802
    """4×4 motion from the mesh to the part frame: z along the axis, origin at its point, x = e1."""
    basis = perpendicular_basis(direction)
    rotation = np.stack([basis[:, 0], basis[:, 1], direction])
    transform = np.eye(4)
    transform[:3, :3] = rotation
    transform[:3, 3] = -rotation @ point_mm
    return transform
