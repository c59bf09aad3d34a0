"""The one choice of basis perpendicular to an axis, shared by everything that states tilts and offsets."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats


def perpendicular_basis(direction: Floats) -> Floats:
    """Two unit vectors perpendicular to ``direction``, as the columns of a (3, 2) array.

    ``(e1, e2, direction)`` is right-handed; e1 is the coordinate axis least aligned with the direction, made
    perpendicular to it.
    """
    start = np.zeros(3)
    start[np.argmin(np.abs(direction))] = 1.0
    e1 = start - direction * (start @ direction)
    e1 /= np.linalg.norm(e1)
    return np.stack([e1, np.cross(direction, e1)], axis=1)


def T_part_mesh(point_mm: Floats, direction: Floats) -> Floats:  # noqa: N802
    """4×4 motion from the mesh to the part frame: z along the axis, origin at its point, x = e1."""
    basis = perpendicular_basis(direction)
    rotation = np.stack([basis[:, 0], basis[:, 1], direction])
    transform = np.eye(4)
    transform[:3, :3] = rotation
    transform[:3, 3] = -rotation @ point_mm
    return transform
