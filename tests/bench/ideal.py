"""A perfect outcome of a small analytic scene, for metrics to be tested on by planting errors."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

import numpy as np

from bench.score.evidence import Evidence
from burrscan.arrays import Floats
from burrscan.axis.basis import T_part_mesh
from burrscan.correspondence import Correspondence, Scan
from burrscan.inspection import Axis, Burr, Generatrix, Inspection, Value
from burrscan.pipeline import Outcome
from burrscan.rig import Rig, View
from burrscan.surface import Surface
from scenes.bound import Bounds
from scenes.truth import Truth
from scenes.wheel import TrueBurr, Wheel

Side = Literal["protrusion", "nick"]
RADIUS_MM = 50.0
HEIGHT, WIDTH = 60, 120
POINT = np.array([3.0, -2.0, 600.0])
DIRECTION = np.array([0.1, 0.99, 0.05]) / np.linalg.norm([0.1, 0.99, 0.05])
T_PART_CAMERA = T_part_mesh(POINT, DIRECTION)
T_PART_CAMERA[2, 3] = -DIRECTION @ POINT  # the part's own z counts from its middle
PROFILE = np.array([[-30.0, RADIUS_MM], [30.0, RADIUS_MM]])
RIG = Rig(View(WIDTH, HEIGHT, 400, 400, 59.5, 29.5), View(100, 80, 300, 300, 49.5, 39.5), np.eye(4))


def true_burr(**changes: Any) -> TrueBurr:
    """An axial ridge at 90 degrees, from z = -10 to 10 mm."""
    burr = TrueBurr(
        kind="axial_ridge", side="protrusion", angle_deg=90.0, z_start_mm=-10.0, z_end_mm=10.0, height_mm=1.0,
        width_mm=2.0, length_mm=20.0, area_mm2=1.0, volume_mm3=20.0, ridge_mm=np.zeros((1, 3)),
        deviation_mm=np.ones(1), arc_deg=2.0,
    )  # fmt: skip
    return replace(burr, **changes)


def found_burr(
    angle_deg: float, z_mm: tuple[float, float], *, height_mm: float = 1.0, side: Side = "protrusion"
) -> Burr:
    """A burr found at a place of the true part frame; ``z_mm`` counts along the axis found, which is true."""
    angle = np.radians(angle_deg)
    middle = np.array([RADIUS_MM * np.cos(angle), RADIUS_MM * np.sin(angle), sum(z_mm) / 2.0])
    pose = np.eye(4)
    pose[:3, 3] = to_camera(middle)
    return Burr(
        side=side, angle_deg=Value(angle_deg, 0.0), z_start_mm=Value(z_mm[0], 0.0),
        z_end_mm=Value(z_mm[1], 0.0), height_mm=Value(height_mm, 0.0),
        width_mm=Value(2.0, 0.0), length_mm=Value(20.0, 0.0),
        area_mm2=Value(1.0, 0.0), volume_mm3=Value(20.0, 0.0), T_mesh_burr=pose, significance=10.0,
    )  # fmt: skip


def to_camera(part_mm: Floats) -> Floats:
    back = np.linalg.inv(T_PART_CAMERA)
    return np.asarray(part_mm @ back[:3, :3].T + back[:3, 3])


def surface_points() -> Floats:
    """Half of the cylinder, part frame: angles 0 to 180 degrees over the columns, z over the rows."""
    angle = np.radians(np.linspace(0.0, 180.0, WIDTH))
    z = np.linspace(-29.5, 29.5, HEIGHT)
    points = np.empty((HEIGHT, WIDTH, 3))
    points[..., 0], points[..., 1] = RADIUS_MM * np.cos(angle), RADIUS_MM * np.sin(angle)
    points[..., 2] = z[:, None]
    return points


def truth(*burrs: TrueBurr) -> Truth:
    """All pixels see the part and are measurable, but for the last ten columns, which get no light."""
    part = surface_points()
    lit = np.arange(WIDTH) < WIDTH - 10
    u = np.where(lit, np.linspace(5.0, 90.0, WIDTH), np.nan).astype(np.float32) + np.zeros(
        (HEIGHT, 1), np.float32
    )
    light = np.broadcast_to(lit, (HEIGHT, WIDTH)).astype(np.float32)
    index = np.full((HEIGHT, WIDTH), -1, np.int32)
    for number, burr in enumerate(burrs):
        angle = np.degrees(np.arctan2(part[..., 1], part[..., 0]))
        inside = (part[..., 2] >= burr.z_start_mm) & (part[..., 2] <= burr.z_end_mm)
        index[inside & (np.abs(angle - burr.angle_deg) < 1.0)] = number
    wheel = Wheel(
        vertices_mm=np.zeros((3, 3)), faces=np.zeros((1, 3), np.int32), normals=np.zeros((3, 3)),
        uvs=np.zeros((3, 2)), face_burr=np.zeros(1, np.int32), generatrix_zr_mm=PROFILE, burrs=burrs,
        name="rod",
    )  # fmt: skip
    return Truth(
        wheel=wheel, rig=RIG, T_part_camera=T_PART_CAMERA, points_mm=to_camera(part), u_px=u, v_px=u,
        u_response_px=u, v_response_px=u, direct=light, indirect=0.0 * light,
        sigma_limit_px=0.1 + 0.0 * light, measurable=light > 0.0, burr_index=index,
        blemish_index=np.full_like(index, -1),
    )  # fmt: skip


def evidence(
    *true: TrueBurr,
    found: tuple[Burr, ...] = (),
    u_error_px: float | Floats = 0.0,
    accept: Any = True,
    shift_mm: float = 0.0,
    T_found_part: Floats | None = None,
    profile: Floats = PROFILE,
    saturated: Any = False,
) -> Evidence:
    """The perfect outcome with errors planted: in the columns, the depth, the part frame, the profile."""
    world = truth(*true)
    u = (np.nan_to_num(world.u_response_px) + u_error_px).astype(np.float32)
    mask = np.broadcast_to(accept, u.shape) & world.measurable
    points = np.where(mask[..., None], world.points_mm + np.array([0.0, 0.0, shift_mm]), np.nan)
    dark = np.zeros(u.shape, np.uint16)
    scan = Scan(
        correspondence=Correspondence(u_px=u, sigma_u_px=np.ones_like(u), mask=mask), frames=42,
        exposures_ms=(1.0,), white=dark + 500, saturated=np.broadcast_to(saturated, u.shape),
        pattern=np.zeros((80, 100), np.uint8), image=dark,
    )  # fmt: skip
    surface = Surface(
        points_mm=points, sigma_mm=np.ones_like(u), mask=mask, vertices_mm=points[mask],
        vertex_sigma_mm=np.ones(mask.sum()), faces=np.zeros((0, 3), np.int32),
        pixels=np.argwhere(mask).astype(np.int32),
    )  # fmt: skip
    frame = T_PART_CAMERA if T_found_part is None else T_found_part @ T_PART_CAMERA
    back = np.asarray(np.linalg.inv(frame), float)
    axis = Axis(point_mm=back[:3, 3], direction=back[:3, 2], covariance=1e-6 * np.eye(4), method="ideal")
    ones = np.ones(len(profile))
    inspection = Inspection(
        axis=axis, generatrix=Generatrix(profile[:, 0], profile[:, 1], 0.1 * ones, 0.2 * ones), burrs=found,
        T_part_mesh=frame, deviation_mm=np.zeros(mask.sum()),
    )  # fmt: skip
    bounds = Bounds(np.full(u.shape, 0.25, np.float32), np.full(u.shape, 0.5, np.float32))
    return Evidence(world, Outcome(scan=scan, surface=surface, inspection=inspection), bounds)
