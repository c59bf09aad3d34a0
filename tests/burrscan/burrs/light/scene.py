"""A cylinder under one lobe, seen by a small rig: points and light by formulas, no mesh and no renderer."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from burrscan.arrays import Bools, Floats
from burrscan.axis.basis import T_part_mesh, origin_mm
from burrscan.burrs.residual import burrs_residual
from burrscan.inspection import Axis, Burr, Generatrix
from burrscan.sight import Sight
from burrscan.triangulation import camera_rays
from tests.burrscan.instrument import small_rig

UPRIGHT = (0.0, 1.0, 0.0)
HALF_LENGTH_MM = 50.0


@dataclass
class Scene:
    """A cylinder of 90 mm radius whose middle is at ``middle_mm``; places on it are told by two lengths.

    ``along`` runs along the axis from the middle; ``around`` runs round it from the line that is nearest to
    the camera, to the right as the camera sees it where the axis points down.
    """

    direction: tuple[float, float, float] = UPRIGHT
    middle_mm: tuple[float, float, float] = (40.0, 0.0, 690.0)
    radius_mm: float = 90.0
    width: int = 400
    depth_noise_mm: float = 0.02
    light_noise: float = 0.02
    seed: int = 0
    log_light: Floats = field(init=False)
    lift_mm: Floats = field(init=False)
    lost: Bools = field(init=False)
    sigma_mm: Floats = field(init=False)

    def __post_init__(self) -> None:
        self.rig = small_rig(width=self.width)
        d = np.asarray(self.direction) / np.linalg.norm(self.direction)
        self.axis = Axis(np.asarray(self.middle_mm), d, np.zeros((4, 4)), "exact")
        z0 = float((np.asarray(self.middle_mm) - origin_mm(self.axis.point_mm, d)) @ d)
        ends = z0 + np.array([-HALF_LENGTH_MM, HALF_LENGTH_MM])
        self.generatrix = Generatrix(ends, np.full(2, self.radius_mm), np.zeros(2), np.zeros(2))
        rays = camera_rays(self.rig.camera)
        middle = np.asarray(self.middle_mm)
        a, b = rays - (rays @ d)[..., None] * d, middle - (middle @ d) * d
        with np.errstate(invalid="ignore"):
            aa, ab = (a * a).sum(axis=-1), a @ b
            depth = (ab - np.sqrt(ab * ab - aa * (b @ b - self.radius_mm**2))) / aa
        self.points = rays * depth[..., None]
        local = self.points - middle
        self.along = local @ d
        self.normal = (local - self.along[..., None] * d) / self.radius_mm
        # the line nearest to the camera, and the way round it
        front = -(b / np.linalg.norm(b))
        side = np.cross(front, d)
        self.around = self.radius_mm * np.arctan2(self.normal @ side, self.normal @ front)
        self.on = np.isfinite(self.along) & (np.abs(self.along) < HALF_LENGTH_MM)
        self._front, self._side, self._d = front, side, d
        rng = np.random.default_rng(self.seed)
        shape = self.rig.camera.shape
        # a lobe of 35 mm (22 degrees) to one side of the front, over three decades
        self.log_light = (
            3.0 - 0.5 * ((self.around - 12.0) / 35.0) ** 2 + self.light_noise * rng.normal(size=shape)
        )
        self.lift_mm = self.depth_noise_mm * rng.normal(size=shape)
        self.sigma_mm = np.full(shape, self.depth_noise_mm)
        self.lost = np.zeros(shape, bool)

    def band(self, around_mm: float, width_mm: float, low_mm: float, high_mm: float) -> Bools:
        """Pixels of a band along the axis."""
        near = np.abs(self.around - around_mm) < 0.5 * width_mm
        return np.asarray(self.on & near & (self.along > low_mm) & (self.along < high_mm))

    def place_mm(self, around_mm: float, along_mm: float) -> Floats:
        """The point of the surface at a place, camera frame."""
        turn = around_mm / self.radius_mm
        out = np.cos(turn) * self._front + np.sin(turn) * self._side
        return np.asarray(np.asarray(self.middle_mm) + along_mm * self._d + self.radius_mm * out)

    def in_part(self, point_mm: Floats) -> Floats:
        """A point of the camera frame in the part frame."""
        T = T_part_mesh(self.axis.point_mm, self.axis.direction)
        return np.asarray(T[:3, :3] @ point_mm + T[:3, 3])

    def sight(self, *, unit: float = 1.0) -> Sight:
        """What a scan of it saw."""
        there = self.on & ~self.lost
        points = np.where(there[..., None], self.points + self.lift_mm[..., None] * self.normal, np.nan)
        light = np.where(self.on, unit * np.exp(self.log_light), 0.0)
        sigma = np.where(there, self.sigma_mm, np.nan)
        return Sight(light.astype(np.float32), points, self.rig, sigma.astype(np.float32))


def dark_line(
    scene: Scene, width_mm: float = 3.0, at: tuple[float, float, float] = (20.0, -15.0, 12.0)
) -> None:
    """A burr whose flanks mirror the light away: a third of what it was, and most of the depth missing."""
    cells = scene.band(at[0], width_mm, at[1], at[2])
    rng = np.random.default_rng(scene.seed + 1)
    scene.log_light[cells] -= 1.1
    scene.lost |= cells & (rng.random(cells.shape) < 0.8)
    scene.lift_mm[cells] += 0.4


def bright_line(
    scene: Scene, width_mm: float = 3.0, at: tuple[float, float, float] = (-25.0, -10.0, 20.0)
) -> None:
    """A nick whose wall mirrors the projector: three times the light, depth below, nothing missing."""
    cells = scene.band(at[0], width_mm, at[1], at[2])
    scene.log_light[cells] += 1.1
    scene.lift_mm[cells] -= 0.4


def burrs_of(
    scene: Scene, *, seen: bool, limit_mm: float | None = None, several_views: bool = False
) -> tuple[Burr, ...]:
    """The burrs of the scene's mesh: neighbouring pixels joined, where all have a depth."""
    sight = scene.sight()
    there = np.isfinite(sight.points_mm[..., 2])
    number = np.cumsum(there).reshape(there.shape) - 1
    whole = there[:-1, :-1] & there[1:, :-1] & there[1:, 1:] & there[:-1, 1:]
    a, b, c, d = (n[whole] for n in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]).astype(np.int32)
    return burrs_residual(
        sight.points_mm[there],
        faces,
        scene.axis,
        scene.generatrix,
        sigma_mm=scene.depth_noise_mm,
        sight=sight if seen else None,
        limit_mm=limit_mm,
        several_views=several_views,
    )
