"""What lies behind the centre of each camera pixel: the surface point, and the face it is on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import drjit as dr
import numpy as np
from scipy import ndimage

from burrscan.arrays import Bools, Floats, Ints32
from scenes.transport.optics import Optics
from scenes.transport.rays import camera_rays


class Hits(NamedTuple):
    """Surface behind the pixel centres.

    ``points_mm`` (h, w, 3) in the camera frame, NaN where there is none; ``faces`` (h, w) index of the
    wheel's face, -1 where there is none.
    """

    points_mm: Floats
    faces: Ints32


def centre_hits(mi: Any, scene: Any, optics: Optics, *, faces_of: Mapping[str, Ints32] | None = None) -> Hits:
    """Intersect the rays through the pixel centres. O(pixels) rays.

    ``faces_of`` gives, by a mesh's name, which of the wheel's faces its own are; without it the scene has one
    mesh, and its faces are the wheel's.
    """
    view = optics.rig.camera
    rays = view.rays(view.pixel_grid())
    directions = rays.reshape(-1, 3) / np.linalg.norm(rays.reshape(-1, 3), axis=1, keepdims=True)
    cast = _cast_vectorised if _vectorised(mi) else _cast_one_by_one
    distance, shape, own = cast(mi, scene, directions.astype(np.float32))
    faces = own if faces_of is None else _wheel_faces(scene, shape, own, faces_of)
    points = np.where((faces >= 0)[:, None], directions * distance[:, None], np.nan)
    return Hits(points.reshape(*view.shape, 3), faces.reshape(view.shape))


def may_see(mi: Any, scene: Any, optics: Optics) -> Bools:
    """Camera pixels (h, w) that may see the surface: within two pixels of one that does.

    Four rays per pixel look for it. Light is traced from these pixels alone; the rest of the image is dark.
    """
    view = optics.rig.camera
    index = dr.arange(mi.UInt32, view.width * view.height)
    column, row = mi.Float(index % view.width), mi.Float(index // view.width)
    pinhole = replace(optics, camera_aperture_mm=0.0)
    found = mi.Bool(False)
    for dx, dy in ((-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25)):
        found |= scene.ray_test(camera_rays(mi, pinhole, column + dx, row + dy, None))
    seen = found.numpy().astype(np.bool_).reshape(view.shape)
    reach = 2 + round(optics.camera_aperture_mm * view.fx / optics.camera_focus_mm)
    return np.asarray(ndimage.binary_dilation(seen, np.ones((3, 3), np.bool_), iterations=reach))


def _wheel_faces(scene: Any, shape: Ints32, own: Ints32, faces_of: Mapping[str, Ints32]) -> Ints32:
    """The wheel's faces, from the number of the mesh in the scene and that of the face in the mesh."""
    tables = [faces_of[str(mesh.id())] for mesh in scene.shapes()]
    first = np.concatenate([[0], np.cumsum([len(table) for table in tables])])
    return np.where(own >= 0, np.concatenate(tables)[first[shape] + np.maximum(own, 0)], -1).astype(np.int32)


def _cast_vectorised(mi: Any, scene: Any, directions: Any) -> tuple[Any, Ints32, Ints32]:
    """Distance, number of the mesh in the scene, and face in the mesh, -1 where nothing is hit."""
    ray = mi.Ray3f(mi.Point3f(0.0), mi.Vector3f(*(np.ascontiguousarray(c) for c in directions.T)))
    hit = scene.ray_intersect_preliminary(ray)
    found = hit.is_valid()
    distance = dr.select(found, hit.t, 0.0)
    faces = mi.Int32(dr.select(found, hit.prim_index, mi.UInt32(0)))
    number = mi.Int32(0)
    for index, mesh in enumerate(scene.shapes()):
        number = dr.select(hit.shape == mi.ShapePtr(mesh), mi.Int32(index), number)
    dr.eval(distance, faces, found, number)
    own = np.where(found.numpy(), faces.numpy(), -1).astype(np.int32)
    return distance.numpy().astype(float), np.array(number.numpy(), np.int32), own


def _cast_one_by_one(mi: Any, scene: Any, directions: Any) -> tuple[Any, Ints32, Ints32]:
    distance, faces = np.zeros(len(directions)), np.full(len(directions), -1, np.int32)
    number = np.zeros(len(directions), np.int32)
    numbers = {str(mesh.id()): index for index, mesh in enumerate(scene.shapes())}
    origin = mi.Point3f(0.0)
    for i, direction in enumerate(directions):
        hit = scene.ray_intersect_preliminary(mi.Ray3f(origin, mi.Vector3f(*direction.tolist())))
        if hit.is_valid():
            distance[i], faces[i], number[i] = hit.t, hit.prim_index, numbers[str(hit.shape.id())]
    return distance, number, faces


def _vectorised(mi: Any) -> bool:
    return not str(mi.variant()).startswith("scalar")
