"""The fitted surface unrolled: cells of arc length and angle, and where camera and projector see them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import ndimage

from burrscan.arrays import Bools, Floats
from burrscan.axis.basis import T_part_mesh
from burrscan.burrs.pixel import pixel_mm
from burrscan.generatrix.polyline import Polyline, polyline_of, revolved
from burrscan.inspection import Axis, Generatrix
from burrscan.pose import placed
from burrscan.rig import Rig, View

_GRAZING = 0.25
"""Cosine of the steepest angle (75 degrees) to look at a cell: beyond it a pixel sees many cells."""
_BEHIND_CELLS = 3.0
"""Depth, in cells, by which a cell lies behind another before it counts as hidden by it."""
_PIXELS = 1.5
"""Half of the three pixels that share a depth: a surface seen at a slope is by so much deeper there. With
cells alone two thirds of those beyond 66 degrees hid each other."""
_APART_CELLS = 4
"""Rows between pieces of the curve that lie as far apart or farther: what is dark on two surfaces is not one
place."""
_BORE = -0.7
"""Radial part of the outward normal below which a surface is a bore's wall, which faces its own far side. On
metal it mirrors that, and light and depth are odd where no burr is: it is not looked at."""
_BORDER_CELLS = 2
"""What is seen and lit is trusted so far from its border: shadows have penumbras, pixels have footprints."""


_MOST_CELLS = 4_000_000
"""Bounds the memory to some hundred megabytes; with more pixels on the part than that, cells are larger."""


@dataclass(frozen=True)
class Unrolled:
    """Cells of the surface, (rows, columns) along the generatrix and around the axis.

    Parameters
    ----------
    z_mm, r_mm
        (rows,) places on the generatrix, part frame; its pieces are apart, nothing is open between them.
    normal
        (rows, 2) outward normal (z, r) there.
    angle
        (columns,) radians in the part frame, around the side that the camera sees.
    pixel
        (2, rows, columns) camera row and column of each cell's middle.
    open
        True where camera and projector both reach the cell and are well away from losing it.
    facing
        The lesser of the cosines at which camera and projector meet it.
    step_mm
        Size of a cell along the curve; around it is that at the largest radius.
    camera_mm, projector_mm
        (3,) their centres, part frame.
    columns
        (3,) direction of the projector's columns, part frame: each is a plane through its centre along it.

    """

    z_mm: Floats
    r_mm: Floats
    normal: Floats
    angle: Floats
    pixel: Floats
    open: Bools
    facing: Floats
    step_mm: float
    camera_mm: Floats
    projector_mm: Floats
    columns: Floats

    def sampled(self, image: Floats, *, order: Literal[0, 1]) -> Floats:
        """(rows, columns) values of a camera image (h, w) at the cells; of order 0 or 1, 0 outside."""
        return np.asarray(ndimage.map_coordinates(image, self.pixel, order=order, mode="constant"))


def unrolled(axis: Axis, generatrix: Generatrix, rig: Rig) -> Unrolled:
    """Unroll the part of a surface that faces the camera, in cells as large as a pixel's footprint or larger.

    Hidden is what lies behind another cell, for the camera or for the projector. O(cells).
    """
    T_part_camera = T_part_mesh(axis.point_mm, axis.direction)
    T_camera_part = np.linalg.inv(T_part_camera)
    to_camera, to_projector = rig.centres_mm(T_part_camera)
    line = polyline_of(generatrix)
    widest = _widest(line, to_camera)
    every_mm2 = 2.0 * widest * float(line.lengths_mm.sum()) * float(line.nodes_mm[:, 1].max())
    step = max(pixel_mm(rig, to_camera, line), float(np.sqrt(every_mm2 / _MOST_CELLS)))
    place, normal, on = _places(line, step)
    turn = step / float(place[:, 1].max())
    half = int(widest / turn)
    angle = np.arctan2(to_camera[1], to_camera[0]) + turn * np.arange(-half, half + 1)
    points, normals = (revolved(each, angle) @ T_camera_part[:3, :3].T for each in (place, normal))
    points = points + T_camera_part[:3, 3]
    seen, pixel, from_camera = _reached(points, normals, np.zeros(3), np.eye(4), rig.camera, step)
    lit, _, from_projector = _reached(
        points, normals, rig.projector_centre_mm, rig.T_projector_camera, rig.projector, step
    )
    solid = ndimage.binary_closing((seen & lit) | ~on, np.ones((3, 3), bool))
    inner = ndimage.binary_erosion(solid, iterations=_BORDER_CELLS)
    reached = seen & lit & inner & on & (normal[:, 1:] > _BORE)
    facing = np.minimum(from_camera, from_projector)
    columns = T_part_camera[:3, :3] @ rig.T_projector_camera[1, :3]
    return Unrolled(
        place[:, 0],
        place[:, 1],
        normal,
        angle,
        pixel,
        reached,
        facing,
        step,
        to_camera,
        to_projector,
        columns,
    )


def _widest(line: Polyline, camera: Floats) -> float:
    """Angle from the side of the camera up to which it sees any front: of an end face all round."""
    (z, r), (along, out) = line.nodes_mm[line.starts].T, line.normals.T
    rises = along * (camera[2] - z) - out * r  # what the front shows, less out · distance · cos(angle)
    swings = out * float(np.hypot(camera[0], camera[1]))
    with np.errstate(divide="ignore", invalid="ignore"):
        angle = np.arccos(np.clip(-rises / swings, -1.0, 1.0))
    angle = np.where(swings > 0.0, angle, np.where(rises > 0.0, np.pi, 0.0))
    return max(float(angle.max()), 0.5 * np.pi)


def _places(line: Polyline, step: float) -> tuple[Floats, Floats, Bools]:
    """Places (z, r) every step along the generatrix, the outward normals there, and (rows, 1) where it is."""
    along = np.append(line.apart_mm(_APART_CELLS * step), np.inf)
    at = np.arange(0.5 * step, along[-2] + line.lengths_mm[-1], step)
    segment = np.searchsorted(along, at, side="right") - 1
    t = (at - along[segment]) / line.lengths_mm[segment]
    place = line.places_mm(segment, np.minimum(t, 1.0))
    return np.maximum(place, [[-np.inf, 1e-9]]), line.normals[segment], (t <= 1.0)[:, None]


def _reached(
    points: Floats, normals: Floats, centre: Floats, T_device_camera: Floats, view: View, step: float
) -> tuple[Bools, Floats, Floats]:
    """Which cells a device reaches, their (row, column) in its raster, and the cosines it sees them at."""
    local = placed(T_device_camera, points)
    pixel = np.moveaxis(view.project(local), -1, 0)[::-1]
    towards = centre - points
    distance = np.linalg.norm(towards, axis=-1)
    cosine = (normals * towards).sum(axis=-1) / distance
    facing = cosine > _GRAZING
    slope = np.sqrt(np.maximum(1.0 - cosine**2, 0.0)) / np.maximum(cosine, _GRAZING)
    slack = _BEHIND_CELLS * step + _PIXELS * distance / view.fx * slope
    return facing & _nearest(pixel, distance, view.shape, slack), pixel, cosine


def _nearest(pixel: Floats, distance: Floats, shape: tuple[int, int], slack: Floats) -> Bools:
    """Which cells nothing hides: a depth buffer, each cell as wide as its neighbours' gap.

    All of them hide what is behind them: limbs that are looked at along the surface, and backs, for the front
    of a solid may be a dark end face that nothing was measured of. ``slack`` is by how much, mm, each may lie
    behind what is nearest.
    """
    row, column = np.rint(pixel).astype(np.int64)
    inside = (row >= 1) & (row < shape[0] - 1) & (column >= 1) & (column < shape[1] - 1)
    buffer = np.full(shape, np.inf)
    np.minimum.at(buffer, (row[inside], column[inside]), distance[inside])
    buffer = ndimage.minimum_filter(buffer, 3)
    found = np.zeros(distance.shape, bool)
    found[inside] = distance[inside] <= buffer[row[inside], column[inside]] + slack[inside]
    return found
