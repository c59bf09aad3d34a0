"""The rig as written in a scene file, and the calibration it stands for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from burrscan.arrays import Floats
from burrscan.documents import STRICT
from burrscan.rig import NO_DISTORTION, Rig, View

Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Pixels = Annotated[int, Field(ge=8, le=16384)]
Vector = tuple[float, float, float]
LEAST_SIDE, MOST_PIXELS = 4, 1 << 25
"""Of a raster once scaled: fewer hold no picture; more (33 million) take more than 4 GB to trace."""


@dataclass(frozen=True)
class DeviceSpec:
    """One device of the rig.

    Parameters
    ----------
    width, height
        Pixels.
    focal_px
        Focal length; pixels are square.
    cx, cy
        Principal point, pixels; the middle of the raster by default.
    distortion
        ``k1, k2, p1, p2, k3`` as OpenCV defines them.
    aperture_mm
        Diameter of the thin lens's pupil (Potmesil & Chakravarty 1982): what is out of focus blurs, shadows
        get a penumbra. 0, the default, is a pinhole, which stock Mitsuba can render too; a camera at f/8 with
        16 mm has 2, a projector's lens about 6.
    focus_mm
        Distance in focus; the rig's standoff by default.

    """

    __pydantic_config__ = STRICT

    width: Pixels
    height: Pixels
    focal_px: Positive
    cx: float | None = None
    cy: float | None = None
    distortion: tuple[float, float, float, float, float] = NO_DISTORTION
    aperture_mm: NotNegative = 0.0
    focus_mm: Positive | None = None

    def view(self, scale: float) -> View:
        """The device with its raster scaled: the same field of view on fewer pixels, to within one pixel."""
        width, height = round(self.width * scale), round(self.height * scale)
        cx = (self.width - 1) / 2.0 if self.cx is None else self.cx
        cy = (self.height - 1) / 2.0 if self.cy is None else self.cy
        focal = self.focal_px * scale  # one factor for both: pixels stay square when the raster is rounded
        return View(
            width=width,
            height=height,
            fx=focal,
            fy=focal,
            cx=(cx + 0.5) * scale - 0.5 + 0.5 * (width - self.width * scale),
            cy=(cy + 0.5) * scale - 0.5 + 0.5 * (height - self.height * scale),
            distortion=self.distortion,
        )


@dataclass(frozen=True)
class RigSpec:
    """Camera and projector, both looking at one target point.

    The defaults: 1280×1024 camera that sees 280 mm at 600 mm, 1024×768 projector that lights 300 mm there, a
    baseline of 200 mm to the camera's right.

    Parameters
    ----------
    standoff_mm
        Distance of the target from the camera, along its optical axis.
    baseline_mm
        Distance of the projector from the camera.
    baseline_azimuth_deg
        Direction of the projector in the camera's xy plane: 0 to its right, 90 below it, where rows
        tell depth: scans count the projector's raster a quarter turn on (:mod:`burrscan.sideways`).
    projector_roll_deg
        Turn of the projector about its own optical axis.
    projector_target_mm
        The point, in the camera frame, that the projector looks at; the camera's target by default.
    scale
        Scales both rasters: 0.5 is a rig of 640×512 and 512×384 with the same field of view.

    """

    __pydantic_config__ = STRICT

    camera: DeviceSpec = DeviceSpec(width=1280, height=1024, focal_px=2743.0)
    projector: DeviceSpec = DeviceSpec(width=1024, height=768, focal_px=2048.0)
    standoff_mm: Positive = 600.0
    baseline_mm: Positive = 200.0
    baseline_azimuth_deg: float = 0.0
    projector_roll_deg: float = 0.0
    projector_target_mm: Vector | None = None
    scale: Annotated[float, Field(gt=0.0, le=8.0)] = 1.0

    def __post_init__(self) -> None:
        for name, device in (("camera", self.camera), ("projector", self.projector)):
            width, height = (round(side * self.scale) for side in (device.width, device.height))
            if min(width, height) < LEAST_SIDE or width * height > MOST_PIXELS:
                raise ValueError(
                    f"{name} of {device.width}×{device.height} px at scale {self.scale:g} makes "
                    f"{width}×{height}: from {LEAST_SIDE} px a side to {MOST_PIXELS} px in all can be traced"
                )

    def rig(self) -> Rig:
        """The calibrated rig."""
        azimuth = np.radians(self.baseline_azimuth_deg)
        centre = self.baseline_mm * np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        target = np.array(self.projector_target_mm or (0.0, 0.0, self.standoff_mm))
        return Rig(
            camera=self.camera.view(self.scale),
            projector=self.projector.view(self.scale),
            T_projector_camera=_look_at(centre, target, np.radians(self.projector_roll_deg)),
        )


def _look_at(centre: Floats, target: Floats, roll: float) -> Floats:
    """4×4 motion into the frame of a device that looks at ``target``, rows level but for the roll."""
    forward = (target - centre) / np.linalg.norm(target - centre)
    right = np.cross([0.0, 1.0, 0.0], forward)
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    c, s = np.cos(roll), np.sin(roll)
    rotation = np.stack([c * right + s * down, c * down - s * right, forward])
    transform = np.eye(4)
    transform[:3, :3] = rotation
    transform[:3, 3] = -rotation @ centre
    return transform
