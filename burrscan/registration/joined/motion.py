"""Small motions: twists, and what they do to poses and to axes."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from burrscan.arrays import Floats
from burrscan.axis.basis import perpendicular_basis, sensed
from burrscan.inspection import Axis


def exponential(twist: Floats) -> Floats:
    """(4, 4) the rotation by a twist's (6,) rotation vector about the origin, then its translation."""
    motion = np.eye(4)
    motion[:3, :3] = Rotation.from_rotvec(twist[:3]).as_matrix()
    motion[:3, 3] = twist[3:]
    return motion


def cross_matrix(vector: Floats) -> Floats:
    """(3, 3) of the product vector × …."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def axis_at(T_target_part: Floats, covariance: Floats, z_mm: float, *, evaluations: int) -> Axis:
    """The part's z axis in a frame.

    Parameters
    ----------
    T_target_part
        (4, 4).
    covariance
        (6, 6) of the twist by which the part frame may be off, along its own axes.
    z_mm
        Where on the axis its point is stated.
    evaluations
        Told of the axis.

    """
    turn, origin = T_target_part[:3, :3], T_target_part[:3, 3]
    direction = sensed(turn[:, 2] / np.linalg.norm(turn[:, 2]))
    basis = perpendicular_basis(direction)
    local = turn.T @ basis  # (3, 2) e1 and e2 along the part's axes
    place = np.array([0.0, 0.0, z_mm])
    by = np.zeros((4, 6))
    by[:2, :3] = local.T
    by[2:, 3:] = local.T
    by[2:, :3] = -local.T @ cross_matrix(place)
    return Axis(origin + z_mm * turn[:, 2], direction, by @ covariance @ by.T, "joint", evaluations)
