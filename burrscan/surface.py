"""A measured surface: the organised range image of one view and its mesh."""

from __future__ import annotations

from dataclasses import dataclass

from burrscan.arrays import Bools, Floats, Floats32, Ints32, freeze


@dataclass(frozen=True)
class Surface:
    """What one scan measured, in the camera frame.

    Parameters
    ----------
    points_mm
        (h, w, 3) a point per camera pixel, NaN where there is none.
    sigma_mm
        (h, w) standard deviation along the camera ray.
    mask
        (h, w) True where there is a point.
    vertices_mm, vertex_sigma_mm
        (V, 3) and (V,) the same points as mesh vertices, in row-major pixel order.
    faces
        (T, 3) indices into the vertices; no face spans a depth discontinuity. Faces look towards the camera:
        counter-clockwise seen from it.
    pixels
        (V, 2) the (row, column) each vertex comes from.

    """

    points_mm: Floats
    sigma_mm: Floats32
    mask: Bools
    vertices_mm: Floats
    vertex_sigma_mm: Floats
    faces: Ints32
    pixels: Ints32

    def __post_init__(self) -> None:
        freeze(self, points_mm=self.points_mm, sigma_mm=self.sigma_mm, mask=self.mask, faces=self.faces)
        freeze(self, vertices_mm=self.vertices_mm, vertex_sigma_mm=self.vertex_sigma_mm, pixels=self.pixels)
