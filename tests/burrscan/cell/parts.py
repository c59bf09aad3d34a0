"""A stepped drum as a chart, a rig, and burrs on it, for tests of the cell."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats
from burrscan.inspection import Axis, Burr, Generatrix, Value
from burrscan.rig import Rig
from scenes.rig import RigSpec

RADIUS_MM = 80.0
STEP_MM = 100.0
"""Radii of the drum below and above z = 40 mm."""


def generatrix(*, step: bool = False) -> Generatrix:
    """A drum from z = 0 to 40 mm, with a wider one above it if wanted, its outside to the left."""
    z = np.linspace(40.0, 0.0, 81)
    curve = np.stack([z, np.full_like(z, RADIUS_MM)], axis=1)
    if step:
        upper = np.linspace(80.0, 40.0, 81)
        wall = np.linspace(STEP_MM, RADIUS_MM, 41)
        curve = np.concatenate(
            [
                np.stack([upper, np.full_like(upper, STEP_MM)], axis=1),
                np.stack([np.full_like(wall, 40.0), wall], axis=1)[1:-1],
                curve,
            ]
        )
    nothing = np.zeros(len(curve))
    return Generatrix(curve[::-1, 0].copy(), curve[::-1, 1].copy(), nothing, nothing)


def axis() -> Axis:
    """The z axis."""
    return Axis(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.eye(4) * 1e-8, "given")


def rig() -> Rig:
    """The default rig at a tenth of its size."""
    return RigSpec(scale=0.1).rig()


def facing(angle_deg: float, *, away_mm: float = 600.0, z_mm: float = 20.0) -> Floats:
    """(4, 4) ``T_camera_part`` of a level camera in front of an angle of the drum."""
    angle = np.radians(angle_deg)
    forward = -np.array([np.cos(angle), np.sin(angle), 0.0])
    right = np.cross(forward, [0.0, 0.0, 1.0])
    rotation = np.stack([right, np.cross(forward, right), forward])
    transform = np.eye(4)
    transform[:3, :3] = rotation
    transform[:3, 3] = -rotation @ (np.array([0.0, 0.0, z_mm]) - away_mm * forward)
    return transform


def burr(
    angle_deg: float = 0.0,
    *,
    side: str = "protrusion",
    height_mm: float = 1.0,
    sigma_mm: float = 0.05,
    length_mm: float = 10.0,
    z_mm: float = 20.0,
    significance: float = 20.0,
    across_mm: float = 0.0,
) -> Burr:
    """An axial burr on the drum, moved across by so much."""
    angle = np.radians(angle_deg) + across_mm / RADIUS_MM
    z_axis = np.array([np.cos(angle), np.sin(angle), 0.0])
    x_axis = np.array([0.0, 0.0, 1.0])
    pose = np.eye(4)
    pose[:3, :3] = np.stack([x_axis, np.cross(z_axis, x_axis), z_axis], axis=1)
    pose[:3, 3] = RADIUS_MM * z_axis + [0.0, 0.0, z_mm]
    return Burr(
        side=side,  # type: ignore[arg-type]
        angle_deg=Value(float(np.degrees(angle)), 0.02),
        z_start_mm=Value(z_mm - 0.5 * length_mm, 0.1),
        z_end_mm=Value(z_mm + 0.5 * length_mm, 0.1),
        height_mm=Value(height_mm, sigma_mm),
        width_mm=Value(1.5, 0.1),
        length_mm=Value(length_mm, 0.2),
        area_mm2=Value(0.75, 0.1),
        volume_mm3=Value(7.5, 1.0),
        T_mesh_burr=pose,
        significance=significance,
    )
