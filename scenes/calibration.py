"""Calibration errors: the rig that an algorithm is told differs from the true one."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from burrscan.documents import STRICT
from burrscan.rig import Rig, View

Vector = tuple[float, float, float]
Pair = tuple[float, float]


@dataclass(frozen=True)
class CalibrationSpec:
    """By how much the told rig is off. All zero by default: a perfect calibration.

    For scale: a careful calibration with a printed board leaves about 0.02 px RMS of reprojection, which for
    this rig corresponds to some 0.005° and 0.05 mm (Moreno & Taubin 2012, table 1).

    Parameters
    ----------
    rotation_deg
        Rotation vector added to the projector's pose, degrees, in the projector frame.
    translation_mm
        Translation added to the projector's pose, mm, in the projector frame.
    camera_focal_share, projector_focal_share
        Relative error of the focal lengths.
    camera_principal_px, projector_principal_px
        Error of the principal points.

    """

    __pydantic_config__ = STRICT

    rotation_deg: Vector = (0.0, 0.0, 0.0)
    translation_mm: Vector = (0.0, 0.0, 0.0)
    camera_focal_share: float = 0.0
    projector_focal_share: float = 0.0
    camera_principal_px: Pair = (0.0, 0.0)
    projector_principal_px: Pair = (0.0, 0.0)

    def told(self, rig: Rig) -> Rig:
        """The rig as the algorithm is told it."""
        turn = np.eye(4)
        turn[:3, :3] = Rotation.from_rotvec(self.rotation_deg, degrees=True).as_matrix()
        turn[:3, 3] = self.translation_mm
        return Rig(
            camera=_off(rig.camera, self.camera_focal_share, self.camera_principal_px),
            projector=_off(rig.projector, self.projector_focal_share, self.projector_principal_px),
            T_projector_camera=turn @ rig.T_projector_camera,
        )


def _off(view: View, focal_share: float, principal_px: Pair) -> View:
    return replace(
        view,
        fx=view.fx * (1.0 + focal_share),
        fy=view.fy * (1.0 + focal_share),
        cx=view.cx + principal_px[0],
        cy=view.cy + principal_px[1],
    )
