"""Binary PLY files of meshes with numbers on their vertices."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from burrscan.arrays import Levels
from burrscan.files import written_whole

_COLOURS = ("red", "green", "blue")


def write_ply(
    path: Path,
    vertices: NDArray[np.floating],
    faces: NDArray[np.integer],
    *,
    scalars: Mapping[str, NDArray[np.floating]],
    colours: Levels | None = None,
    comment: str = "coordinates in millimetres",
) -> None:
    """Write a binary little-endian PLY, whole or not at all.

    Parameters
    ----------
    path
        The file.
    vertices, faces
        (V, 3) and (T, 3); a cloud has no faces.
    scalars
        Name (with its unit) to (V,) values: float properties, which MeshLab, CloudCompare and Blender show.
    colours
        (V, 3) red, green, blue, or None.
    comment
        One line of the header.

    """
    fields = ["x", "y", "z", *scalars]
    kinds = [(name, "<f4") for name in fields] + [(name, "u1") for name in _COLOURS if colours is not None]
    record = np.empty(len(vertices), dtype=np.dtype(kinds))
    for name, values in zip(fields, (*vertices.T, *scalars.values()), strict=True):
        record[name] = values
    if colours is not None:
        for name, channel in zip(_COLOURS, colours.T, strict=True):
            record[name] = channel
    triangles = np.empty(len(faces), dtype=np.dtype([("count", "u1"), ("corners", "<i4", 3)]))
    triangles["count"], triangles["corners"] = 3, faces
    header = "\n".join(
        [
            "ply",
            "format binary_little_endian 1.0",
            f"comment burrscan; {comment}",
            f"element vertex {len(record)}",
            *(f"property {'float' if kind == '<f4' else 'uchar'} {name}" for name, kind in kinds),
            f"element face {len(triangles)}",
            "property list uchar int vertex_indices",
            "end_header\n",
        ]
    )
    with written_whole(Path(path)) as beside:
        beside.write_bytes(header.encode("ascii") + record.tobytes() + triangles.tobytes())
