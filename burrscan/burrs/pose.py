"""The pose of a burr on the fitted surface, and how it lies there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from burrscan.arrays import Floats
from burrscan.axis.basis import T_part_mesh
from burrscan.inspection import Axis, Burr, Value
from burrscan.turns import turn_deg, turn_rad


def share_around(burr: Burr, axis: Axis) -> float:
    """Cosine of the angle between a burr and the parallel that it stands on, 0 to 1."""
    tangent = np.cross(axis.direction, burr.T_mesh_burr[:3, 3] - axis.point_mm)
    return abs(float(burr.T_mesh_burr[:3, 0] @ tangent)) / max(float(np.linalg.norm(tangent)), 1e-300)


def turned_to(burr: Burr, angle_rad: Value, z_mm: float, axis: Axis) -> Burr:
    """A burr that runs along the axis, turned about it until it is at an angle where z is so many mm."""
    pose = T_part_mesh(axis.point_mm, axis.direction) @ burr.T_mesh_burr
    (x, y, z), along = pose[:3, 3], pose[:3, 0]
    lean = float((along[1] * x - along[0] * y) / along[2] * (z_mm - z) / (x * x + y * y))
    turn = turn_rad(float(angle_rad.value - np.arctan2(y, x) - lean))
    return turned_by(burr, Value(turn, angle_rad.sigma), axis)


def turned_by(burr: Burr, turn_rad: Value, axis: Axis) -> Burr:
    """A burr turned about the axis; the turn's standard deviation is that of its angle then."""
    T_part = T_part_mesh(axis.point_mm, axis.direction)
    cos, sin = np.cos(turn_rad.value), np.sin(turn_rad.value)
    T_turned = np.eye(4)
    T_turned[:2, :2] = [[cos, -sin], [sin, cos]]
    angle = turn_deg(burr.angle_deg.value + float(np.degrees(turn_rad.value)))
    return replace(
        burr,
        angle_deg=Value(angle, float(np.degrees(turn_rad.sigma))),
        T_mesh_burr=np.linalg.inv(T_part) @ T_turned @ T_part @ burr.T_mesh_burr,
    )


def pose_on_surface(foot: Floats, normal: Floats, angle: float, direction: Floats, axis: Axis) -> Floats:
    """T_mesh_burr: :func:`part_pose` in the frame of the mesh, whose ``axis`` is the part's."""
    result: Floats = np.linalg.inv(T_part_mesh(axis.point_mm, axis.direction)) @ part_pose(
        foot, normal, angle, direction
    )
    return result


def part_pose(foot: Floats, normal: Floats, angle: float, direction: Floats) -> Floats:
    """(4, 4) in the part frame: origin on the generatrix surface under the burr, x along it, z outwards.

    Parameters
    ----------
    foot, normal
        (2,) place (z, r) on the generatrix, and its outward normal (z, r).
    angle
        Radians, part frame.
    direction
        (2,) of the burr: around the axis, and along the generatrix.

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
    return pose
