"""A wheel in front of the rig, as a Mitsuba scene without emitters or sensors: the thing that light meets.

Mitsuba's world frame is the camera frame (OpenCV axes, millimetres).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from burrscan.arrays import Floats, Ints32
from scenes.finish import Channels
from scenes.surface.optics import part_bsdf
from scenes.surface.parts import SurfacePart
from scenes.wheel import Wheel


def wheel_mesh(mi: Any, wheel: Wheel, T_camera_part: Floats, bsdf: dict[str, Any]) -> Any:
    """The wheel as one Mitsuba mesh in the camera frame, with its exact normals and turning directions."""
    return _mesh(mi, "wheel", wheel, T_camera_part, bsdf, faces=wheel.faces, uvs=wheel.uvs)


def wheel_shapes(
    mi: Any, wheel: Wheel, T_camera_part: Floats, parts: Sequence[SurfacePart], *, channels: Channels
) -> dict[str, Any]:
    """The wheel as one Mitsuba mesh per part of its surface, by name, for a scene's dictionary."""
    return {
        part.name: _mesh(
            mi,
            part.name,
            wheel,
            T_camera_part,
            part_bsdf(mi, part, channels=channels),
            faces=wheel.faces[part.faces],
            uvs=part.uvs,
        )
        for part in parts
    }


def _mesh(
    mi: Any,
    name: str,
    wheel: Wheel,
    T_camera_part: Floats,
    bsdf: dict[str, Any],
    *,
    faces: Ints32,
    uvs: Floats,
) -> Any:
    used, index = np.unique(faces, return_inverse=True)
    properties = mi.Properties()
    properties["mesh_bsdf"] = mi.load_dict(bsdf)
    mesh = mi.Mesh(
        name, len(used), len(faces), has_vertex_normals=True, has_vertex_texcoords=True, props=properties
    )
    rotation = T_camera_part[:3, :3]
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = _flat(wheel.vertices_mm[used] @ rotation.T + T_camera_part[:3, 3])
    parameters["vertex_normals"] = _flat(wheel.normals[used] @ rotation.T)
    parameters["vertex_texcoords"] = _flat(uvs[used])
    parameters["faces"] = np.ascontiguousarray(index, dtype=np.uint32).ravel()
    parameters.update()
    return mesh


def _flat(array: Floats) -> Any:
    return np.ascontiguousarray(array, dtype=np.float32).ravel()
