"""Stages that know the truth. They stand where a pipeline's own stage stood; no algorithm ever calls them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from burrscan.arrays import Floats
from burrscan.axis.basis import T_part_mesh as T_part_mesh_of
from burrscan.axis.basis import origin_mm, sensed
from burrscan.inspection import Axis, Burr, Generatrix, Value
from burrscan.pipeline import Pipeline, Stage
from burrscan.pose import placed
from scenes.wheel import TrueBurr

_SURE = 1e-6
"""Standard deviation that an oracle states, mm and rad."""


def knowing(pipeline: Pipeline, kind: str, answer: object) -> Pipeline:
    """A pipeline one of whose stages is told its answer."""
    return replace(pipeline, **{kind: Stage("bench.budget.oracle:told", {"answer": answer})})


def told(*_given: object, answer: object, sigma_mm: Floats | None = None) -> object:
    """Say what was told, in the place of axis, generatrix or burrs."""
    del sigma_mm
    return answer


def true_axis(T_part_mesh: Floats, vertices_mm: Floats) -> Axis:
    """The axis of the part in the mesh's frame, with the sign and the point that :class:`Axis` asks for."""
    to_mesh = np.linalg.inv(T_part_mesh).astype(float)
    origin, direction = to_mesh[:3, 3], to_mesh[:3, 2]
    direction = sensed(direction)
    middle = np.nanmean(vertices_mm, axis=0)
    point = origin + ((middle - origin) @ direction) * direction
    return Axis(point, direction, _SURE**2 * np.eye(4), "oracle")


def true_generatrix(T_part_mesh: Floats, generatrix_zr_mm: Floats, axis: Axis) -> Generatrix:
    """The outline, its z in the frame that ``axis`` states; turned round where the axis points backwards."""
    outline = np.asarray(generatrix_zr_mm, float)
    sense = float(np.sign(T_part_mesh[2, :3] @ axis.direction))
    start = float(placed(T_part_mesh, origin_mm(axis.point_mm, axis.direction))[2])
    z, r = sense * (outline[:, 0] - start), outline[:, 1]
    if sense < 0.0:
        z, r = z[::-1], r[::-1]
    return Generatrix(z, r, np.full(len(z), _SURE), np.zeros(len(z)))


def true_burrs(T_part_mesh: Floats, burrs: tuple[TrueBurr, ...], axis: Axis) -> tuple[Burr, ...]:
    """The burrs as a perfect pipeline would report them."""
    return tuple(_burr(T_part_mesh, burr, axis) for burr in burrs)


def _burr(T_part_mesh: Floats, burr: TrueBurr, axis: Axis) -> Burr:
    start = float(placed(T_part_mesh, origin_mm(axis.point_mm, axis.direction))[2])
    sense = float(np.sign(T_part_mesh[2, :3] @ axis.direction))
    ends = sorted(sense * (z - start) for z in (burr.z_start_mm, burr.z_end_mm))
    angle = np.radians(burr.angle_deg)
    stated = T_part_mesh_of(axis.point_mm, axis.direction) @ np.linalg.inv(T_part_mesh)
    outward = np.array([np.cos(angle), np.sin(angle), 0.0])
    middle = np.array([outward[0], outward[1], 0.5 * (burr.z_start_mm + burr.z_end_mm)])
    in_part = np.eye(4)  # x along the burr, z outwards
    in_part[:3, :3] = np.stack([[0.0, 0.0, 1.0], np.cross(outward, [0.0, 0.0, 1.0]), outward], axis=1)
    in_part[:3, 3] = middle
    sizes = (burr.height_mm, burr.width_mm, burr.length_mm, burr.area_mm2, burr.volume_mm3)
    height, width, length, area, volume = (Value(float(size), _SURE) for size in sizes)
    return Burr(
        side=burr.side,
        angle_deg=Value(float(np.degrees(np.arctan2(*(stated[:2, :3] @ outward)[::-1]))), _SURE),
        z_start_mm=Value(ends[0], _SURE),
        z_end_mm=Value(ends[1], _SURE),
        height_mm=height,
        width_mm=width,
        length_mm=length,
        area_mm2=area,
        volume_mm3=volume,
        T_mesh_burr=np.linalg.inv(T_part_mesh) @ in_part,
        significance=np.inf,
    )
