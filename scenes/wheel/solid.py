"""A closed triangle mesh whose vertices carry normals and uv, and its passage through manifold3d."""

from __future__ import annotations

from dataclasses import dataclass

import manifold3d
import numpy as np

from burrscan.arrays import Floats, Ints
from burrscan.errors import InputError


@dataclass(frozen=True)
class Solid:
    """A closed mesh; vertices at creases and seams are repeated with one normal and uv each.

    Parameters
    ----------
    points_mm
        (V, 3) positions.
    normals
        (V, 3) unit outward normals of the exact surface.
    uvs
        (V, 2) texture coordinates, u along the circumference.
    faces
        (T, 3) counter-clockwise from outside.
    same_from, same_to
        (M,) pairs of vertices that are one point of the closed surface.

    """

    points_mm: Floats
    normals: Floats
    uvs: Floats
    faces: Ints
    same_from: Ints
    same_to: Ints


def to_manifold(solid: Solid, closing_faces: Ints | None = None) -> tuple[manifold3d.Manifold, int]:
    """Hand a solid to manifold3d; the second value is the id that its triangles keep through booleans.

    ``closing_faces`` (C, 3) are added behind the solid's own.
    """
    original = manifold3d.Manifold.reserve_ids(1)
    faces = solid.faces if closing_faces is None else np.concatenate([solid.faces, closing_faces])
    mesh = manifold3d.Mesh64(
        vert_properties=np.hstack([solid.points_mm, solid.normals, solid.uvs]),
        tri_verts=np.ascontiguousarray(faces, dtype=np.uint64),
        merge_from_vert=solid.same_from.astype(np.uint64),
        merge_to_vert=solid.same_to.astype(np.uint64),
        run_index=np.array([0, faces.size], dtype=np.uint64),
        run_original_id=np.array([original], dtype=np.uint32),
        # every triangle is a face of its own: manifold3d must not join coplanar ones, their uv differ
        face_id=np.arange(len(faces), dtype=np.uint64),
    )
    manifold = manifold3d.Manifold(mesh)
    if manifold.status() != manifold3d.Error.NoError:
        raise InputError(f"the solid is not closed: {manifold.status()}; report the wheel that makes it")
    return manifold, original
