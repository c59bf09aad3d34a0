"""The pose of a burr on the fitted surface, and how it lies there."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats
from burrscan.axis.basis import T_part_mesh
from burrscan.inspection import Axis, Burr


def share_around(burr: Burr, axis: Axis) -> float:
    """Cosine of the angle between a burr and the parallel that it stands on, 0 to 1."""
    tangent = np.cross(axis.direction, burr.T_mesh_burr[:3, 3] - axis.point_mm)
    return abs(float(burr.T_mesh_burr[:3, 0] @ tangent)) / max(float(np.linalg.norm(tangent)), 1e-300)


def pose_on_surface(foot: Floats, normal: Floats, angle: float, direction: Floats, axis: Axis) -> Floats:
    """T_mesh_burr: origin on the generatrix surface under the burr, x along it, z outwards.

    Parameters
    ----------
    foot, normal
        (2,) place (z, r) on the generatrix, and its outward normal (z, r).
    angle
        Radians, part frame.
    direction
        (2,) of the burr: around the axis, and along the generatrix.
    axis
        The axis of the part frame.

    """
    (z, r), (nz, nr) = foot, normal
    outward = np.array([np.cos(angle), np.sin(angle), 0.0])
    around = np.array([-np.sin(angle), np.cos(angle), 0.0])
    up = np.array([0.0, 0.0, 1.0])
    out = nr * outward + nz * up
    along = direction[0] * around + direction[1] * (nr * up - nz * outward)
    pose = np.eye(4)
    pose[:3, 0], pose[:3, 1], pose[:3, 2] = along, np.cross(out, along), out
    pose[:3, 3] = r * outward + z * up
    result: Floats = np.linalg.inv(T_part_mesh(axis.point_mm, axis.direction)) @ pose
    return result
