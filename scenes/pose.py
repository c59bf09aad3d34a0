"""Where the wheel stands in front of the camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from burrscan.arrays import Floats
from burrscan.documents import STRICT

_UPRIGHT = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
"""Part to camera axes at rest: the wheel's axis upright (camera -y), its angle 0 facing the camera."""


@dataclass(frozen=True)
class PoseSpec:
    """The pose of a wheel; at rest its axis is upright and its angle 0 faces the camera.

    Applied in this order: spin, elevation, yaw, roll, offset.

    Parameters
    ----------
    spin_deg
        Turn of the part about its own axis: it moves what is at angle ``-spin_deg`` to face the camera.
    elevation_deg
        Tilt of the upper end of the axis towards the camera; 90 shows the wheel's face.
    yaw_deg
        Turn about the camera's vertical; it matters once the axis is tilted.
    roll_deg
        Turn about the camera's line of sight, clockwise as seen.
    offset_mm
        Place of the wheel's middle relative to the rig's target point, in camera axes.

    """

    __pydantic_config__ = STRICT

    spin_deg: float = 0.0
    elevation_deg: float = 0.0
    yaw_deg: float = 0.0
    roll_deg: float = 0.0
    offset_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def T_camera_part(self, *, standoff_mm: float, middle_z_mm: float) -> Floats:  # noqa: N802
        """4×4 motion from part to camera; the axis point at ``middle_z_mm`` goes to the target."""
        turns = (
            Rotation.from_euler("z", self.roll_deg, degrees=True)
            * Rotation.from_euler("y", self.yaw_deg, degrees=True)
            * Rotation.from_euler("x", self.elevation_deg, degrees=True)
        )
        spin = Rotation.from_euler("z", self.spin_deg, degrees=True).as_matrix()
        transform = np.eye(4)
        transform[:3, :3] = turns.as_matrix() @ _UPRIGHT @ spin
        target = np.array([0.0, 0.0, standoff_mm]) + self.offset_mm
        transform[:3, 3] = target - transform[:3, :3] @ (0.0, 0.0, middle_z_mm)
        return transform


def pose_of(T_camera_part: Floats, *, standoff_mm: float, middle_z_mm: float) -> PoseSpec:
    """The specification of a (4, 4) rigid motion from part to camera; its yaw is zero.

    The inverse of :meth:`PoseSpec.T_camera_part`: every motion has one, for spin, elevation and roll are
    Euler angles about y, x and z of the camera.
    """
    turns = Rotation.from_matrix(T_camera_part[:3, :3] @ _UPRIGHT.T)
    roll, elevation, around = turns.as_euler("ZXY", degrees=True)
    middle = T_camera_part[:3, :3] @ (0.0, 0.0, middle_z_mm) + T_camera_part[:3, 3]
    x, y, z = (float(value) for value in middle - (0.0, 0.0, standoff_mm))
    # the part's own z is the camera's -y at rest
    return PoseSpec(
        spin_deg=float(-around), elevation_deg=float(elevation), roll_deg=float(roll), offset_mm=(x, y, z)
    )
