"""Meshes as drawings have them: few large facets without noise, vertices at their corners only.

The generatrix and the burr stage read a surface off its vertices, as a scanner leaves them: close and evenly
spread. A drawing's vertices say nothing of the surface between them, and a burr's lie on its outline alone.
So its facets are sampled as densely as a fine scan. A facet is the chord of the curve that it stands for: its
points are put back by the sagitta, as large as its corners tell, and that sagitta is stated as their noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Bools, Floats, Ints32
from burrscan.axis.basis import T_part_mesh
from burrscan.axis.points.subdivide import is_coarse
from burrscan.inspection import Axis, Check
from burrscan.pose import placed
from burrscan.turns import turn_rad

SPACING = 0.004
"""Distance between samples, as a share of the largest radius: 0.4 mm on a wheel 200 mm across."""
FEWEST, MOST = 50_000, 1_000_000
"""Samples: fewer leave small burrs without any, more cost time and memory and tell nothing new."""
_OPEN = 2.0
"""Half of a mesh's area in edges longer than so many spacings, and its vertices do not show the surface."""
_FLAT = 1e-3
"""Angle between facets, rad, that a quadrilateral cut in two has (float32 files included), a scan has not."""
_FLAT_SHARE = 0.2
"""A mesh of cut quadrilaterals has a third of its edges flat; noise of each vertex leaves hardly any."""
_ALONG = 2e-3
"""Angle between an edge and its parallel up to which it runs along it, rad: what the axis of a drawing may be
off by (0.1 degrees)."""
_ALONG_SHARE = 0.03
"""A third of the edges of cut quadrilaterals run so, 0.045 to 0.33 where flutes, lugs or spokes are; of scans
up to 0.014, by chance."""
_ALONG_OTHERS = 5.0
"""By chance edges run so at any angle: of those within so many times the angle fewer than half within it."""
_WIDEST = np.radians(45.0)
"""A facet that spans more of the circle than this is an end face, not the chord of a wall."""
_SURE = 0.95
"""Quantile of the facets' errors that is stated: a few long facets at end faces are not the wall's."""
_ROUNDING = 1e-5
"""Noise of a drawing at least, as a share of its largest radius: what axis and generatrix err by."""
_COARSEST = 0.005
"""Facet error, as a share of the largest radius, up to which burrs of a hundredth of it are found."""
_GOLDEN = 1.32471795724474602596
"""Its powers make the most evenly spread sequence in a plane (Roberts 2018, R2)."""


@dataclass(frozen=True)
class Sampled:
    """A drawing with its facets sampled.

    Parameters
    ----------
    vertices_mm
        (V + N, 3) the vertices given, then samples of the facets between them.
    faces
        (T, 3) as given: they tell inside from outside; no face names a sample.
    sigma_mm
        (V + N,) the facet error.
    facet_error_mm
        What 95 % of the area is nearer to the curve it stands for.

    """

    vertices_mm: Floats
    faces: Ints32
    sigma_mm: Floats
    facet_error_mm: float

    def check(self, axis: Axis) -> Check:
        """Whether the facets are fine enough to tell burrs from corners."""
        part = T_part_mesh(axis.point_mm, axis.direction)
        limit = _COARSEST * float(_radius(placed(part, self.vertices_mm)).max())
        return Check(
            "facets", self.facet_error_mm <= limit, self.facet_error_mm, limit, "mm",
            "the mesh is a drawing: burrs hardly higher than its facet error are not seen; export it with a "
            "smaller chord tolerance",
        )  # fmt: skip


def sampled(vertices_mm: Floats, faces: Ints32, axis: Axis, *, sigma_mm: float = 0.0) -> Sampled | None:
    """Sample the facets of a drawing; None for a scan, whose vertices show the surface themselves.

    Parameters
    ----------
    vertices_mm, faces
        (V, 3) finite, each place once, and (T, 3).
    axis
        Of the part: facets are chords about it.
    sigma_mm
        What the user states all vertices to err by: the facet error is stated as no less.

    Notes
    -----
    A drawing is known by facets that are long even against the part, or by edges longer than the samples
    would be apart while facets beside each other are flat, and stand in rings: a scan that was smoothed, or
    whose noise neighbours share, is as flat, but its edges run in any direction. Systematic sampling by area,
    barycentric coordinates from the R2 sequence: the same samples each time. O(T log T + N).

    """
    if not len(faces):
        return None
    part = T_part_mesh(axis.point_mm, axis.direction)
    local = placed(part, vertices_mm)
    largest = float(_radius(local).max())
    corners = local[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * np.linalg.norm(normal, axis=1)
    if not area.sum() > 0.0 or not _is_drawn(local, faces, normal, area, SPACING * largest):
        return None
    count = int(np.clip(area.sum() / (SPACING * largest) ** 2, FEWEST, MOST))
    points, sagitta, face = _points(corners, area, count)
    slope = np.hypot(normal[:, 0], normal[:, 1]) / np.maximum(2.0 * area, 1e-300)
    error = float(np.quantile(sagitta * slope[face], _SURE))
    vertices = np.concatenate([vertices_mm, (points - part[:3, 3]) @ part[:3, :3]])
    sigma = max(error, sigma_mm, _ROUNDING * largest)
    return Sampled(vertices, _outward(local, faces), np.full(len(vertices), sigma), error)


def _outward(local: Floats, faces: Ints32) -> Ints32:
    """The faces of a closed mesh seen from outside: some exports are inside out, burrs would be nicks."""
    a, b, c = (local[faces[:, k]] for k in range(3))
    closed = len(_twins(faces)[0]) * 2 == 3 * len(faces)
    inside_out = closed and float((a * np.cross(b, c)).sum()) < 0.0
    return np.ascontiguousarray(faces[:, ::-1]) if inside_out else faces


def _radius(local: Floats) -> Floats:
    return np.asarray(np.hypot(local[..., 0], local[..., 1]))


def _is_drawn(local: Floats, faces: Ints32, normal: Floats, area: Floats, spacing: float) -> bool:
    edges = np.stack([local[faces[:, k]] - local[faces[:, (k + 1) % 3]] for k in range(3)])
    long: Bools = (edges**2).sum(axis=2).max(axis=0) > (_OPEN * spacing) ** 2
    if area[long].sum() < 0.5 * area.sum():
        return False
    size = float(np.sqrt(((local - local.mean(axis=0)) ** 2).sum(axis=1).mean()))
    if is_coarse((local - local.mean(axis=0)) / size, faces):
        return True
    return _flat_share(faces, normal) > _FLAT_SHARE and _in_rings(local, faces, edges)


def _in_rings(local: Floats, faces: Ints32, edges: Floats) -> bool:
    """Whether edges (3, T, 3) run along parallels more often than chance has it."""
    profile = np.column_stack([local[:, 2], _radius(local)])
    across = np.stack([profile[faces[:, k]] - profile[faces[:, (k + 1) % 3]] for k in range(3)])
    slant, length = (np.linalg.norm(each, axis=2) for each in (across, edges))
    along, about = (float((slant < angle * length).mean()) for angle in (_ALONG, _ALONG_OTHERS * _ALONG))
    return along > _ALONG_SHARE and along > 0.5 * about


def _flat_share(faces: Ints32, normal: Floats) -> float:
    """Share of the edges between two faces at which these lie in one plane."""
    unit = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    one, other = _twins(faces)
    turn = np.linalg.norm(np.cross(unit[one], unit[other]), axis=1)
    return float((turn < _FLAT).mean()) if len(turn) else 0.0


def _twins(faces: Ints32) -> tuple[Ints32, Ints32]:
    """Pairs of faces that share an edge, (E,) each."""
    ends = np.sort(np.concatenate([faces[:, [k, (k + 1) % 3]] for k in range(3)]), axis=1).astype(np.int64)
    key = ends[:, 0] * (int(faces.max()) + 1) + ends[:, 1]
    order = np.argsort(key, kind="stable")
    twins = np.flatnonzero(np.diff(key[order]) == 0)
    one, other = order[twins] % len(faces), order[twins + 1] % len(faces)
    return one.astype(np.int32), other.astype(np.int32)


def _points(corners: Floats, area: Floats, count: int) -> tuple[Floats, Floats, Ints32]:
    """(N, 3) samples in the part frame, by how much each was put back outwards, and their facets."""
    before = np.cumsum(area)
    share = (np.arange(count) + 0.5) / count * before[-1]
    face = np.minimum(np.searchsorted(before, share, side="right"), len(area) - 1).astype(np.int32)
    s, t = ((np.arange(count) * _GOLDEN**-power + 0.5) % 1.0 for power in (1, 2))
    beyond = s + t > 1.0
    s[beyond], t[beyond] = 1.0 - s[beyond], 1.0 - t[beyond]
    weight = np.stack([1.0 - s - t, s, t], axis=1)
    points = sum((weight[:, k : k + 1] * corners[face, k] for k in (1, 2)), weight[:, :1] * corners[face, 0])
    radius = _radius(points)
    angle = np.arctan2(corners[..., 1], corners[..., 0])
    span = np.abs(turn_rad(angle - angle[:, :1])).max(axis=1)
    wall = (span < _WIDEST)[face] & (radius > 0.0)
    sagitta = np.where(wall, (weight * _radius(corners)[face]).sum(axis=1) - radius, 0.0)
    points[:, :2] *= (1.0 + sagitta / np.maximum(radius, 1e-300))[:, None]
    return points, sagitta, face
