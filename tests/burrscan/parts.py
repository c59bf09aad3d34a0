"""Scans with exact axis, for the tests of generatrix and burrs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bench.synthetic.revolution import RevolutionScan, grid_faces, profile_of, random_pose
from burrscan.arrays import Floats, Ints32
from burrscan.axis.basis import T_part_mesh, origin_mm
from burrscan.inspection import Axis


def exact_axis(scan: RevolutionScan) -> Axis:
    """The true axis of a scan, in the form that a method gives it."""
    middle = np.nanmean(scan.vertices_mm, axis=0)
    point = scan.point_mm + ((middle - scan.point_mm) @ scan.direction) * scan.direction
    return Axis(point, scan.direction, np.zeros((4, 4)), "exact")


def z_offset_mm(scan: RevolutionScan, axis: Axis) -> float:
    """What to add to z along the axis found to get the part's own z."""
    return float((origin_mm(axis.point_mm, axis.direction) - scan.point_mm) @ scan.direction)


def angle_in_frame_deg(scan: RevolutionScan, axis: Axis, angle_deg: float) -> float:
    """The atan2 angle, in the frame found, of an angle in the part's own frame."""
    turn = np.radians(angle_deg)
    there = scan.T_mesh_part[:3, :3] @ [np.cos(turn), np.sin(turn), 0.0]
    found = T_part_mesh(axis.point_mm, axis.direction)[:3, :3] @ there
    return float(np.degrees(np.arctan2(found[1], found[0])))


def turned(degrees: float) -> float:
    """An angle difference brought to -180 .. 180."""
    return float((degrees + 180.0) % 360.0 - 180.0)


def distance_to_polyline(points: Floats, polyline: Floats) -> Floats:
    """(N,) distance of (N, 2) points from a (K, 2) polyline, every pair tried."""
    start, step = polyline[:-1], np.diff(polyline, axis=0)
    gap = points[:, None] - start
    share = np.clip((gap * step).sum(axis=2) / (step**2).sum(axis=1), 0.0, 1.0)
    return np.asarray(np.linalg.norm(gap - share[..., None] * step, axis=2).min(axis=1))


def scattered_scan(
    profile: str,
    lift_mm: Callable[[Floats, Floats, Floats], Floats],
    *,
    vertices: int = 60_000,
    arc_deg: float = 140.0,
    sigma_mm: float = 0.05,
    seed: int = 0,
) -> RevolutionScan:
    """A cloud spread at random over a surface of revolution: no two vertices share an angle or a height.

    ``lift_mm`` is a function of (z, r, angle) that gives the deviation along the normal.
    """
    rng = np.random.default_rng(seed)
    polyline = profile_of(profile)
    step = np.diff(polyline, axis=0)
    length = np.hypot(*step.T)
    k = rng.choice(len(step), vertices, p=length / length.sum())
    place = polyline[k] + rng.random(vertices)[:, None] * step[k]
    normal = np.stack([-step[k, 1], step[k, 0]], axis=1) / length[k, None]
    angle = np.radians(rng.uniform(-arc_deg / 2, arc_deg / 2, vertices))
    lift = lift_mm(place[:, 0], place[:, 1], angle)
    z, r = (place + (lift + sigma_mm * rng.normal(size=vertices))[:, None] * normal).T
    pose = random_pose(rng)
    points = np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1) @ pose[:3, :3].T + pose[:3, 3]
    return RevolutionScan(points, np.empty((0, 3), np.int32), pose, sigma_mm)


def whole_wheel(profile: Floats, *, around: int = 360) -> tuple[Floats, Ints32]:
    """Vertices and faces of a surface that goes all the way round, axis z."""
    angle = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)[:, None]
    points = np.stack(
        [
            profile[:, 1] * np.cos(angle),
            profile[:, 1] * np.sin(angle),
            np.broadcast_to(profile[:, 0], (around, len(profile))),
        ],
        axis=-1,
    )
    faces = grid_faces(around + 1, len(profile)) % (around * len(profile))
    return points.reshape(-1, 3), faces.astype(np.int32)
