"""What goes into the joint estimate of poses, axis and curve, and what comes out."""

from __future__ import annotations

from dataclasses import dataclass

from burrscan.arrays import Bools, Floats, freeze
from burrscan.errors import InputError
from burrscan.inspection import Axis, Generatrix


@dataclass(frozen=True)
class PosePrior:
    """How good the robot's reported poses are, one sigma per axis, each pose by itself.

    Parameters
    ----------
    sigma_mm, sigma_deg
        Of the camera's place and of its rotation: the arm's accuracy, with the hand-eye calibration's.

    """

    sigma_mm: float = 0.5
    sigma_deg: float = 0.2

    def __post_init__(self) -> None:
        if not (self.sigma_mm > 0.0 and self.sigma_deg > 0.0):
            raise InputError("the poses' sigma_mm and sigma_deg must be above zero: state the arm's accuracy")


@dataclass(frozen=True)
class Joint:
    """Poses, axis and curve of several views, estimated together.

    Parameters
    ----------
    T_world_camera
        (N, 4, 4) the poses; the world is the frame of the reported ones, such as the robot's base.
    covariance
        (6N, 6N) of all poses: per view the rotation vector in rad and the translation in mm at ``middle_mm``,
        along the world's axes.
    middle_mm
        (3,) a point of the axis amid the data, in the world frame.
    axis
        In the world frame. Its covariance holds what the robot does not know, which all views share in part.
    axes_camera
        The axis in each view's camera frame, where the robot's word hardly enters.
    generatrix
        The curve in the part frame of ``axis`` (:func:`burrscan.axis.basis.T_part_mesh`).
    noise_mm
        (N,) standard deviation of the points about the curve.
    used
        (N,) share of each view's points that lie on the curve.
    roll_sigma_deg
        (N,) standard deviation of each view's turn about the axis against the first; 0 for the first.
    roll_seen
        (N,) whether something that is not round (a burr, a boss) told of that turn.
    iterations
        How many it took.

    """

    T_world_camera: Floats
    covariance: Floats
    middle_mm: Floats
    axis: Axis
    axes_camera: tuple[Axis, ...]
    generatrix: Generatrix
    noise_mm: Floats
    used: Floats
    roll_sigma_deg: Floats
    roll_seen: Bools
    iterations: int

    def __post_init__(self) -> None:
        freeze(self, T_world_camera=self.T_world_camera, covariance=self.covariance, middle_mm=self.middle_mm)
        freeze(self, noise_mm=self.noise_mm, used=self.used)
        freeze(self, roll_sigma_deg=self.roll_sigma_deg, roll_seen=self.roll_seen)
