"""Synthetic scans of surfaces of revolution with known truth: no rendering, only geometry and noise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from pydantic import Field
from scipy.ndimage import uniform_filter

from burrscan.arrays import Floats, Ints32
from burrscan.documents import STRICT
from burrscan.pose import placed
from burrscan.turns import turn_deg


def _arc(radius_mm: float, middle_mm: float, reach_rad: float) -> Floats:
    """Points (z, r) on a circle about (0, ``middle_mm``), outermost in the middle."""
    angle = np.linspace(-reach_rad, reach_rad, 400)
    return np.stack([radius_mm * np.sin(angle), middle_mm + radius_mm * np.cos(angle)], axis=1)


_Z = np.linspace(-60.0, 60.0, 400)  # of the vase: 120 mm tall
PROFILES: dict[str, Any] = {
    # (z, r) in mm. The stepped wheel of METHODS: radius 80 to 100 mm, 60 mm wide, same Cramér-Rao bounds.
    "stepped_wheel": ((-30, 80), (-12, 82), (-12, 90), (8, 92), (8, 100), (30, 100)),
    "cylinder": ((-30, 90), (30, 90)),
    "cone": ((-30, 70), (30, 100)),
    "flanged_hub": ((-30, 40), (-30, 100), (-20, 100), (-20, 60), (30, 55), (30, 30)),
    "plane": ((0, 20), (0, 100)),
    "torus": _arc(25.0, 80.0, 0.75 * np.pi),  # the outer half of its circle, plus some of the inner half
    "vase": np.stack([_Z, 60.0 + 20.0 * np.sin(_Z / 22.0) + 5.0 * np.cos(_Z / 9.0)], axis=1),
    "sphere": _arc(90.0, 0.0, 1.0),  # a zone of it
}
SHAPES = tuple(PROFILES)
"""Every named shape."""


def profile_of(shape: str | Floats) -> Floats:
    """The (K, 2) polyline (z, r) of a named shape; a polyline is its own."""
    return np.array(PROFILES[shape] if isinstance(shape, str) else shape, np.float64)


@dataclass(frozen=True)
class RidgeBurr:
    """A ridge of triangular cross-section parallel to the axis, in the part frame.

    Parameters
    ----------
    angle_deg
        Its middle; the middle of the arc that the scan shows is at 0.
    height_mm
        Along the normal of the surface; 0 for none. A nick's is below 0: no suite has one.
    width_deg
        Of its base.
    z_start_mm, z_end_mm
        Extent along the axis.

    """

    __pydantic_config__ = STRICT

    angle_deg: float = 10.0
    height_mm: Annotated[float, Field(ge=0.0)] = 2.0
    width_deg: Annotated[float, Field(gt=0.0)] = 0.6
    z_start_mm: float = -30.0
    z_end_mm: float = 30.0

    def height_at(self, z_mm: Floats, phi_rad: Floats) -> Floats:
        """Height above the surface at places of it, any shape."""
        turn = turn_deg(np.degrees(phi_rad) - self.angle_deg)
        along = (z_mm >= self.z_start_mm) & (z_mm <= self.z_end_mm)
        tent = np.clip(1.0 - 2.0 * np.abs(turn) / self.width_deg, 0.0, None)
        return np.asarray(self.height_mm * tent * along)


@dataclass(frozen=True)
class Disturbance:
    """What the noise is made of.

    Parameters
    ----------
    sigma_mm
        Its standard deviation along the normal.
    correlated_over
        Rows and columns of the grid over which it is averaged first; its deviation stays the same.
    outlier_share
        Share of vertices that are off by up to 20 mm.

    """

    sigma_mm: float
    correlated_over: int = 1
    outlier_share: float = 0.0

    def drawn(self, shape: tuple[int, int], rng: np.random.Generator) -> Floats:
        """One lift for each vertex of a grid."""
        lift = rng.normal(size=shape)
        if self.correlated_over > 1:
            lift = self.correlated_over * uniform_filter(lift, self.correlated_over, mode="wrap")
        lift *= self.sigma_mm
        outlier = rng.random(shape) < self.outlier_share
        lift[outlier] += rng.uniform(-20.0, 20.0, int(outlier.sum()))
        return np.asarray(lift)


@dataclass(frozen=True)
class RevolutionScan:
    """A scan and its truth: the part's axis is the z axis of its pose."""

    vertices_mm: Floats
    faces: Ints32
    T_mesh_part: Floats
    sigma_mm: float

    @property
    def point_mm(self) -> Floats:
        """(3,) a point of the true axis."""
        return self.T_mesh_part[:3, 3]

    @property
    def direction(self) -> Floats:
        """(3,) of the true axis."""
        return self.T_mesh_part[:3, 2]

    def angle_error_deg(self, direction: Floats) -> float:
        """Angle between a direction and the true axis."""
        return axis_angle_deg(direction, self.direction)


def axis_angle_deg(first: Floats, second: Floats) -> float:
    """Angle between two lines without sense, degrees."""
    sine = np.linalg.norm(np.cross(first, second))
    return float(np.degrees(np.arctan2(sine, abs(float(first @ second)))))


def reached(polyline: Floats) -> Floats:
    """(K,) arc length from its start to each point of a polyline."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(polyline, axis=0).T))])


def on_curve(polyline: Floats, along: Floats) -> tuple[Floats, Floats]:
    """Places (z, r) at arc lengths along a polyline, and unit normals (z, r), outwards."""
    start, step = reached(polyline), np.diff(polyline, axis=0)
    k = np.clip(np.searchsorted(start, along, side="right") - 1, 0, len(step) - 1)
    tangent = step[k] / np.hypot(*step[k].T)[:, None]
    places = polyline[k] + tangent * (along - start[k])[:, None]
    return places, np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)


def grid_faces(rows: int, columns: int) -> Ints32:
    """Two triangles per cell of a rows × columns grid of vertices in row-major order."""
    index = np.arange(rows * columns, dtype=np.int32).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
    return np.stack([a, c, b, b, c, d], axis=-1).reshape(-1, 3)


def random_pose(rng: np.random.Generator, *, reach_mm: float = 500.0) -> Floats:
    """A 4×4 motion with a uniform random rotation."""
    q = rng.normal(size=4)
    w, x, y, z = q / np.linalg.norm(q)
    pose = np.eye(4)
    pose[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    pose[:3, 3] = rng.uniform(-reach_mm, reach_mm, 3)
    return pose


def revolution_scan(
    profile: str | Floats = "stepped_wheel",
    *,
    arc_deg: float = 140.0,
    shape: tuple[int, int] = (484, 128),
    sigma_mm: float = 0.0,
    seed: int | tuple[int, ...] = 0,
    burrs: tuple[RidgeBurr, ...] = (),
    scale: float = 1.0,
    outlier_share: float = 0.0,
    correlated_over: int = 1,
) -> RevolutionScan:
    """A partial scan as METHODS defines it: a grid of (around, along) vertices, iid noise along the normal.

    The default has 122,682 triangles. The middle of the arc is at angle 0 of the part frame; the pose is
    random. ``scale`` multiplies everything, noise included; the noise is a :class:`Disturbance`.
    """
    rng = np.random.default_rng(seed)
    polyline = profile_of(profile)
    around, along = shape
    phi = np.radians(np.linspace(-arc_deg / 2, arc_deg / 2, around))[:, None]
    places = np.linspace(0.0, reached(polyline)[-1], along)
    noise = Disturbance(sigma_mm, correlated_over, outlier_share)
    points = lifted(polyline, places, phi, noise.drawn(shape, rng), burrs)
    pose = random_pose(rng, reach_mm=500.0 * scale)
    return RevolutionScan(placed(pose, scale * points), grid_faces(*shape), pose, scale * sigma_mm)


def lifted(
    polyline: Floats, along: Floats, phi: Floats, lift: Floats, burrs: tuple[RidgeBurr, ...]
) -> Floats:
    """(N, 3) points of the part frame: arc length and angle say where, ``lift`` and burrs how far out."""
    curve, normal = on_curve(polyline, along)
    for burr in burrs:
        lift = lift + burr.height_at(curve[:, 0], phi)
    z, r = (curve[:, i] + lift * normal[:, i] for i in range(2))
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1).reshape(-1, 3)
