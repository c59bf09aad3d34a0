"""Views of a turned part with bosses, its poses as a robot tells them, and the bound of what can be known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bench.synthetic.revolution import grid_faces
from burrscan.arrays import Floats
from burrscan.registration import PosedSurface
from tests.burrscan.registration.views import motion, true_pose

HALF_MM, ARC_DEG = 25.0, 130.0


def radius(z: Floats) -> Floats:
    """A tapered part with a smooth step and a groove."""
    return 50.0 + 0.15 * z + 4.0 / (1.0 + np.exp(-(z - 5.0) / 2.5)) - 2.5 * np.exp(-(((z + 12.0) / 5.0) ** 2))


def slope(z: Floats) -> Floats:
    return (radius(z + 1e-5) - radius(z - 1e-5)) / 2e-5


def bosses(phi: Floats, z: Floats) -> Floats:
    """Lift along the radius, mm: two rows of small bosses all round, uneven, and narrow ridges."""
    height = np.zeros(np.broadcast_shapes(phi.shape, z.shape))
    for k in range(9):
        off = np.angle(np.exp(1j * (phi - 2.0 * np.pi * (k + 0.2 * (k % 2)) / 9.0))) * 50.0
        height = height + 1.0 / (
            1.0 + np.exp(np.clip((np.hypot(off, z - 16.0 + 3.0 * (k % 3)) - 2.0) / 0.2, -50, 50))
        )
    return height


@dataclass(frozen=True)
class Shot:
    """Views with their true poses; the axis is the world's z."""

    views: list[PosedSurface]
    true: list[Floats]


def shot(
    turns_deg: list[float],
    seed: int,
    *,
    shape: tuple[int, int] = (120, 60),
    sigma_mm: float = 0.02,
    robot_mm: float = 0.5,
    robot_deg: float = 0.2,
    bossed: bool = True,
    world: Floats | None = None,
) -> Shot:
    """Views from around, noise along the normal, each reported pose off by the robot's accuracy."""
    rng = np.random.default_rng(seed)
    views, true = [], []
    for turn in turns_deg:
        phi, z = np.meshgrid(
            np.radians(turn + np.linspace(-ARC_DEG / 2, ARC_DEG / 2, shape[0])),
            np.linspace(-HALF_MM, HALF_MM, shape[1]),
            indexing="ij",
        )
        # strictly regular rows would themselves tell where z is: they are as good as edges
        phi = phi + rng.uniform(-0.5, 0.5, phi.shape) * np.radians(ARC_DEG) / (shape[0] - 1)
        z = z + rng.uniform(-0.5, 0.5, z.shape) * 2.0 * HALF_MM / (shape[1] - 1)
        tangent = slope(z)
        noise = sigma_mm * rng.normal(size=phi.shape) / np.hypot(1.0, tangent)
        r = radius(z) + (bosses(phi, z) if bossed else 0.0) + noise
        along = z - tangent * noise
        points = np.stack([r * np.cos(phi), r * np.sin(phi), along], axis=-1).reshape(-1, 3)
        pose = true_pose(turn)
        error = motion(robot_deg * rng.normal(size=3), np.zeros(3))
        rough = pose.copy()
        rough[:3, :3] = error[:3, :3] @ pose[:3, :3]
        rough[:3, 3] += robot_mm * rng.normal(size=3)
        frame = np.eye(4) if world is None else world
        views.append(
            PosedSurface(
                (points - pose[:3, 3]) @ pose[:3, :3],
                grid_faces(*shape),
                np.full(len(points), sigma_mm),
                frame @ rough,
            )
        )
        true.append(frame @ pose)
    return Shot(views, true)
