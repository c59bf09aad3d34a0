"""Poses from documents: rigid motions and nothing else."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats
from burrscan.errors import InputError

_OFF = 1e-3
"""How far from orthonormal a rotation may be: three decimals in a file leave half of that."""


def rigid(pose: Floats, *, what: str) -> Floats:
    """A (4, 4) pose as it is, if it is a rotation and a translation.

    Raises
    ------
    InputError
        When it scales, shears or mirrors, holds numbers that are not finite, or its last row is not 0 0 0 1.

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
    else:
        return pose
    raise InputError(f"{what}: {reason}; a pose is a rotation and a translation in mm")
