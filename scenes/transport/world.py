"""A wheel in front of the rig, as a Mitsuba scene without emitters or sensors: the thing that light meets.

Mitsuba's world frame is the camera frame (OpenCV axes, millimetres).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from burrscan.arrays import Floats
from scenes.wheel import Wheel


def wheel_mesh(mi: Any, wheel: Wheel, T_camera_part: Floats, bsdf: dict[str, Any]) -> Any:
    """The wheel as a Mitsuba mesh in the camera frame, with its exact normals and its turning directions."""
    properties = mi.Properties()
    properties["mesh_bsdf"] = mi.load_dict(bsdf)
    mesh = mi.Mesh(
        "wheel",
        len(wheel.vertices_mm),
        len(wheel.faces),
        has_vertex_normals=True,
        has_vertex_texcoords=True,
        props=properties,
    )
    rotation = T_camera_part[:3, :3]
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = _flat(wheel.vertices_mm @ rotation.T + T_camera_part[:3, 3])
    parameters["vertex_normals"] = _flat(wheel.normals @ rotation.T)
    parameters["vertex_texcoords"] = _flat(wheel.uvs)
    parameters["faces"] = np.ascontiguousarray(wheel.faces, dtype=np.uint32).ravel()
    parameters.update()
    return mesh


def _flat(array: Floats) -> Any:
    return np.ascontiguousarray(array, dtype=np.float32).ravel()
