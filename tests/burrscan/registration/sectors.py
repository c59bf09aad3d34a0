"""Sectors of dense, noisy scans with truth: a turned pawn, a wheel, with bosses and keyways or round."""

from __future__ import annotations

import numpy as np
from scipy.special import expit

from bench.synthetic.revolution import grid_faces
from burrscan.arrays import Floats
from burrscan.registration import PosedSurface
from tests.burrscan.registration.views import motion, true_pose

TURNS = (0.0, 90.0, 180.0, 270.0)
ARC_DEG = 140.0
OVERLAP = (ARC_DEG - 90.0) / ARC_DEG
"""Share of a sector that its neighbour shows as well: 36 %."""


def pawn(z: Floats) -> Floats:
    """Radius of a turned chessman: foot, waist, collar, head."""
    foot = 9.0 / (1.0 + np.exp((z + 14.0) / 1.5))
    collar = 4.0 * np.exp(-(((z - 8.0) / 1.5) ** 2))
    head = 3.0 * np.exp(-(((z - 16.0) / 5.0) ** 2))
    return 7.0 + foot + collar + head - 0.05 * z


def wheel(z: Floats) -> Floats:
    """Radius of a stepped, tapered wheel."""
    return 50.0 + 0.15 * z + 4.0 / (1.0 + np.exp(-(z - 5.0) / 1.5))


def lift(phi: Floats, z: Floats, reach: float) -> Floats:
    """Seven bosses, no two alike, and two keyways, mm: what is not round."""
    height = np.zeros(np.broadcast_shapes(phi.shape, z.shape))
    for k in range(7):
        off = np.angle(np.exp(1j * (phi - 2.0 * np.pi * (k + 0.13 * (k % 3)) / 7.0)))
        square = (off * reach / 3.0) ** 2 + ((z - (k % 3 - 1) * 8.0) / 3.0) ** 2
        height = height + (0.6 + 0.1 * k) * expit((1.0 - square) / 0.2)
    for middle in (0.9, 3.3):
        off = np.abs(np.angle(np.exp(1j * (phi - middle)))) * reach
        height = height - expit((2.0 - off) / 0.3)
    return height


def sector(
    turn_deg: float,
    rng: np.random.Generator,
    *,
    shape: str = "pawn",
    bosses: bool = True,
    spacing_mm: float = 0.1,
    noise_mm: float = 0.1,
    gridded: bool = True,
    robot_mm: float = 0.5,
    robot_deg: float = 0.2,
    stated: bool = False,
    half_mm: float = 20.0,
) -> PosedSurface:
    """140 degrees of a part about z: noise alike in all directions, a pose that is off as the robot's is.

    Gridded sectors are meshes, whose triangles fold over where the noise is larger than the spacing; others
    are clouds of points in no order.
    """
    radius_at, reach = (pawn, 12.0) if shape == "pawn" else (wheel, 50.0)
    arc = np.radians(ARC_DEG)
    around, along = int(arc * reach / spacing_mm), int(2.0 * half_mm / spacing_mm)
    if gridded:
        phi, z = np.meshgrid(
            np.linspace(-arc / 2, arc / 2, around), np.linspace(-half_mm, half_mm, along), indexing="ij"
        )
        faces = grid_faces(around, along)
    else:
        phi = rng.uniform(-arc / 2, arc / 2, around * along)
        z = rng.uniform(-half_mm, half_mm, around * along)
        faces = np.zeros((0, 3), np.int32)
    phi = phi + np.radians(turn_deg)
    radius = radius_at(z) + (lift(phi, z, reach) if bosses else 0.0)
    points = np.stack([radius * np.cos(phi), radius * np.sin(phi), z], axis=-1).reshape(-1, 3)
    pose = true_pose(turn_deg)
    in_camera = (points - pose[:3, 3]) @ pose[:3, :3] + noise_mm * rng.normal(size=points.shape)
    rough = pose.copy()
    rough[:3, :3] = motion(robot_deg * rng.normal(size=3), np.zeros(3))[:3, :3] @ pose[:3, :3]
    rough[:3, 3] += robot_mm * rng.normal(size=3)
    sigma = np.full(len(points), noise_mm if stated else np.nan)
    return PosedSurface(in_camera, faces, sigma, rough)
