"""What may not touch the part or the table: the scanner, the wrist and the spindle, as spheres."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Floats
from burrscan.cell.positioner import OutOfReachError
from burrscan.pose import placed
from burrscan.rig import Rig
from scenes.wheel import deviation_mm

_DEVICE_MM = 60.0
"""Radius of a sphere around a camera or a projector; it lies behind the lens by as much."""
_WRIST_MM = 70.0
"""Radius of the wrist around the flange."""
_SPINDLE_MM = 18.0
"""Radius of the spindle, which begins where the mill ends."""
_SPINDLE_LONG_MM = 120.0
"""Its length."""


@dataclass(frozen=True)
class Bodies:
    """Spheres that move with the flange: (N, 3) middles in its frame, (N,) radii, and names."""

    middles_mm: Floats
    radii_mm: Floats
    names: tuple[str, ...]

    def refuse_touching(
        self,
        T_base_flange: Floats,
        *,
        T_base_plate: Floats,
        T_plate_part: Floats,
        generatrix_zr_mm: Floats,
        plate_radius_mm: float,
    ) -> None:
        """Raise OutOfReachError where one of them touches the part or the plate. O(spheres × outline)."""
        on_plate = np.linalg.inv(T_base_plate) @ T_base_flange
        middles = placed(on_plate, self.middles_mm)
        in_part = placed(np.linalg.inv(T_plate_part), middles)
        clear = deviation_mm(in_part, generatrix_zr_mm) - self.radii_mm
        beside = np.maximum(np.hypot(middles[:, 0], middles[:, 1]) - plate_radius_mm, 0.0)
        above = np.hypot(beside, np.maximum(middles[:, 2], 0.0)) - self.radii_mm
        for what, gap in (("the part", clear), ("the table", above)):
            worst = int(np.argmin(gap))
            if gap[worst] < 0.0:
                raise OutOfReachError(
                    f"{self.names[worst]} would touch {what}, {-gap[worst]:.0f} mm deep: choose another pose"
                )


def bodies(
    rig: Rig,
    *,
    T_flange_camera: Floats,
    T_flange_tool: Floats,
    mill_length_mm: float,
) -> Bodies:
    """The scanner's two devices, the wrist, and the spindle above the mill."""
    forward = rig.T_projector_camera[2, :3]
    lenses = np.array([[0.0, 0.0, -_DEVICE_MM], rig.projector_centre_mm - _DEVICE_MM * forward])
    devices = placed(T_flange_camera, lenses)
    along = np.arange(mill_length_mm + _SPINDLE_MM, mill_length_mm + _SPINDLE_LONG_MM, _SPINDLE_MM)
    spindle = np.outer(along, T_flange_tool[:3, 2]) + T_flange_tool[:3, 3]
    return Bodies(
        np.concatenate([devices, np.zeros((1, 3)), spindle]),
        np.array([_DEVICE_MM, _DEVICE_MM, _WRIST_MM, *[_SPINDLE_MM] * len(spindle)]),
        ("the camera", "the projector", "the wrist", *["the spindle"] * len(spindle)),
    )
