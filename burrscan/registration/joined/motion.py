"""What a small motion of the part does to its axis."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats
from burrscan.axis.basis import perpendicular_basis, sensed
from burrscan.inspection import Axis
from burrscan.pose import cross_matrix


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
