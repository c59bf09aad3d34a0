"""What the light paths need to know of the two devices, beyond the calibration that an algorithm is told."""

from __future__ import annotations

from dataclasses import dataclass

from burrscan.rig import Rig
from scenes.transport.profile import PixelProfile


@dataclass(frozen=True)
class Optics:
    """The true rig with its finite lenses.

    Parameters
    ----------
    rig
        The true geometry.
    standoff_mm
        Distance at which a white diffuser facing the projector defines light 1.
    camera_aperture_mm, projector_aperture_mm
        Diameters of the entrance and exit pupils; 0 is a pinhole: everything in focus.
    camera_focus_mm, projector_focus_mm
        Distances along the optical axes at which they are in focus.
    profile
        Light profile of a projector pixel.

    """

    rig: Rig
    standoff_mm: float
    camera_aperture_mm: float = 0.0
    projector_aperture_mm: float = 0.0
    camera_focus_mm: float = 600.0
    projector_focus_mm: float = 600.0
    profile: PixelProfile = PixelProfile()
