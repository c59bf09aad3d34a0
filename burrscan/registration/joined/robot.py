"""What the robot says of the poses, as rows of the same least-squares problem."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from burrscan.arrays import Floats
from burrscan.pose import cross_matrix
from burrscan.registration.joined.types import PosePrior

BASE = 4
"""Unknowns of the part in the world: two tilts and two shifts of its axis. Its place along the axis and its
turn about it are those of the views."""
_BASE_PARTS = (0, 1, 3, 4)
"""Of a twist, which those are."""


def robot_rows(
    reported: Floats, poses: Floats, T_world_part: Floats, prior: PosePrior
) -> tuple[Floats, Floats]:
    """Normal equations (6N + 4, 6N + 4) and (6N + 4,) of the reported poses.

    Parameters
    ----------
    reported
        (N, 4, 4) T_world_camera as the robot says.
    poses
        (N, 4, 4) T_part_camera as they are now.
    T_world_part
        (4, 4) as it is now.
    prior
        How good the robot's word is.

    """
    count = len(poses)
    size = 6 * count + BASE
    square, pull = np.zeros((size, size)), np.zeros(size)
    weight = np.repeat([np.radians(prior.sigma_deg), prior.sigma_mm], 3) ** -2.0
    back = np.linalg.inv(T_world_part)
    for number, (said, pose) in enumerate(zip(reported, poses, strict=True)):
        there = back @ said
        turned = Rotation.from_matrix(pose[:3, :3] @ there[:3, :3].T).as_rotvec()
        off = np.concatenate([turned, pose[:3, 3] - there[:3, 3]])
        own = np.eye(6)
        own[3:, :3] = -cross_matrix(pose[:3, 3])
        rows = np.zeros((6, size))
        rows[:, 6 * number : 6 * number + 6] = own
        rows[:, 6 * count :] = own[:, _BASE_PARTS]
        square += (rows.T * weight) @ rows
        pull += (rows.T * weight) @ off
    return square, pull


def base_motion(step: Floats) -> Floats:
    """(6,) twist of the part frame by its (4,) unknowns."""
    twist = np.zeros(6)
    twist[list(_BASE_PARTS)] = step
    return twist


def base_covariance(covariance: Floats) -> Floats:
    """(6, 6) of that twist by (4, 4) of its unknowns."""
    whole = np.zeros((6, 6))
    whole[np.ix_(_BASE_PARTS, _BASE_PARTS)] = covariance
    return whole
