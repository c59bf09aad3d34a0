"""Views of one analytic part from known places."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from bench.synthetic.revolution import grid_faces
from burrscan.arrays import Floats
from burrscan.registration import PosedSurface

SHAPE = (110, 60)


def motion(rotvec_deg: Floats, shift_mm: Floats) -> Floats:
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec(rotvec_deg, degrees=True).as_matrix()
    pose[:3, 3] = shift_mm
    return pose


def part(phi: Floats, z: Floats, *, lobes: float, step_mm: float = 1.5) -> Floats:
    """A stepped, tapered part; lobes break its symmetry, a short step is steep."""
    radius = 50.0 + 0.15 * z + 4.0 / (1.0 + np.exp(-(z - 5.0) / step_mm)) + lobes * np.cos(5.0 * phi)
    return np.stack([radius * np.cos(phi), radius * np.sin(phi), z], axis=-1)


def true_pose(turn_deg: float) -> Floats:
    """A camera 400 mm away that looks at the axis from that side; its z looks at the part."""
    angle = np.radians(turn_deg)
    outward = np.array([np.cos(angle), np.sin(angle), 0.0])
    down = np.array([0.0, 0.0, -1.0])
    pose = np.eye(4)
    pose[:3, :3] = np.stack([np.cross(down, -outward), down, -outward], axis=1)
    pose[:3, 3] = 400.0 * outward
    return pose


def view(
    turn_deg: float,
    rng: np.random.Generator,
    *,
    lobes: float = 1.0,
    step_mm: float = 1.5,
    sigma_mm: float = 0.02,
    robot_mm: float = 0.5,
    robot_deg: float = 0.2,
) -> PosedSurface:
    """140 degrees of the part, noise along the camera's ray, a pose that is off as the robot's is."""
    phi, z = np.meshgrid(
        np.radians(turn_deg + np.linspace(-70.0, 70.0, SHAPE[0])),
        np.linspace(-25.0, 25.0, SHAPE[1]),
        indexing="ij",
    )
    pose = true_pose(turn_deg)
    points = part(phi.ravel(), z.ravel(), lobes=lobes, step_mm=step_mm)
    in_camera = (points - pose[:3, 3]) @ pose[:3, :3]
    rays = in_camera / np.linalg.norm(in_camera, axis=1, keepdims=True)
    in_camera = in_camera + sigma_mm * rng.normal(size=(len(points), 1)) * rays
    error = motion(robot_deg * rng.normal(size=3), np.zeros(3))
    rough = pose.copy()
    rough[:3, :3] = error[:3, :3] @ pose[:3, :3]
    rough[:3, 3] += robot_mm * rng.normal(size=3)
    return PosedSurface(in_camera, grid_faces(*SHAPE), np.full(len(points), sigma_mm), rough)
