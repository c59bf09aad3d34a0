"""Poses: rigid motions from documents and from twists, and points moved by them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from burrscan.arrays import Floats
from burrscan.errors import InputError

_OFF = 1e-3
"""How far from orthonormal a rotation may be: three decimals in a file leave half of that."""
_FARTHEST_MM = 1e6
"""No scanner stands a kilometre off; a number that is another unit's, or damaged, does."""


def rigid(pose: Floats, *, what: str) -> Floats:
    """A (4, 4) pose as it is, if it is a rotation and a translation.

    Raises
    ------
    InputError
        When it scales, shears or mirrors, holds numbers that are not finite, shifts by more than a kilometre,
        or its last row is not 0 0 0 1.

    """
    turn = pose[:3, :3]
    with np.errstate(all="ignore"):
        off = float(np.abs(turn @ turn.T - np.eye(3)).max())
        mirrored = float(np.linalg.det(turn)) < 0.0
    if not np.isfinite(pose).all():
        reason = "holds numbers that are not finite"
    elif not np.array_equal(pose[3], [0.0, 0.0, 0.0, 1.0]):
        reason = "has another last row than 0 0 0 1"
    elif not off < _OFF:
        reason = f"scales or shears: its rotation times its transpose is off the identity by {off:.2g}"
    elif mirrored:
        reason = "mirrors: the determinant of its rotation is negative"
    elif not np.abs(pose[:3, 3]).max() <= _FARTHEST_MM:
        reason = f"shifts by {np.abs(pose[:3, 3]).max():.2g} mm"
    else:
        return pose
    raise InputError(f"{what}: {reason}; a pose is a rotation and a translation in mm")


def placed(T_target_source: NDArray[np.floating], points_mm: Floats) -> Floats:
    """Points (..., 3) taken from the source frame to the target frame by a (4, 4) pose."""
    moved: Floats = points_mm @ T_target_source[:3, :3].T
    moved += T_target_source[:3, 3]
    return moved


def exponential(twist: Floats) -> Floats:
    """(4, 4) the rotation by a twist's (6,) rotation vector (rad) about the origin, then its translation."""
    motion = np.eye(4)
    motion[:3, :3] = Rotation.from_rotvec(twist[:3]).as_matrix()
    motion[:3, 3] = twist[3:]
    return motion


def cross_matrix(vector: Floats) -> Floats:
    """(3, 3) of the product vector × …."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
