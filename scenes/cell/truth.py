"""What really happened in a simulated cell: where the mill was over a burr, and what it left."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Bools, Floats, Ints32
from burrscan.turns import turn_deg, turn_rad
from scenes.wheel import TrueBurr, Wheel, deviation_mm

_FINE_MM = 0.15
"""Faces that a mill left are looked at in pieces of this size: the deepest place lies inside of them."""
_NEAR_MM = 6.0
"""Of a burr's length around the mill that its middle is taken over."""
_SLICE_MM = 0.5
"""Between sections of its outline."""
_LEAST_FACE_MM = 1.0
"""Pieces of the outline that are longer are faces, not roundings."""
_SQUARE = np.cos(np.radians(20.0))
"""Faces that lean to each other by less make no edge."""
_BESIDE_MM = 1.0
"""Around a burr's extent that counts as its place."""


@dataclass(frozen=True)
class Left:
    """What is left of a burr, and what was taken of the part.

    Parameters
    ----------
    residual_mm
        Largest height over the ideal surface in the burr's place.
    gouge_mm
        Largest depth under it, anywhere that the mill was.

    """

    residual_mm: float
    gouge_mm: float


def tool_over(T_part_tool: Floats, wheel: Wheel, number: int) -> tuple[float, float]:
    """Where the middle of the mill's end is over a burr, mm: across it, and along the surface's normal.

    Across it counts from the middle of what the burr covers of the part, near the mill: of a plain burr that
    is the middle of its base, as :class:`burrscan.inspection.Burr` has it, and of a curled one that of its
    outline, for from above its root is not seen; of one on an edge it is the edge. The surface under the burr
    is taken for the plane face (in the meridian) of its middle.
    """
    burr, generatrix_zr_mm = wheel.burrs[number], wheel.generatrix_zr_mm
    x, y, z = T_part_tool[:3, 3]
    crest = burr.ridge_mm[len(burr.ridge_mm) // 2]
    foot, normal = _foot(np.array([crest[2], np.hypot(crest[0], crest[1])]), generatrix_zr_mm)
    radius = float(np.hypot(x, y))
    if burr.kind == "rim":
        base = np.array([z, radius]) - _edge_beside(foot, normal, generatrix_zr_mm)
        return float(base @ np.array([normal[1], -normal[0]])), float(base @ normal)
    turn = np.arctan2(y, x) - _middle(wheel, number, z)
    across = radius * np.sin(turn)
    height = (np.array([z, radius * np.cos(turn)]) - foot) @ normal
    return float(across), float(height)


def _edge_beside(foot: Floats, normal: Floats, curve: Floats) -> Floats:
    """(2,) where the face under a rim's crest meets the next one, both as long as if nothing was rounded."""
    start, step = curve[:-1], np.diff(curve, axis=0)
    length = np.linalg.norm(step, axis=1)
    normals = np.stack([-step[:, 1], step[:, 0]], axis=1) / length[:, None]
    others = (length > _LEAST_FACE_MM) & (np.abs(normals @ normal) < _SQUARE)
    meet = [
        np.linalg.solve(np.stack([normal, own]), [foot @ normal, place @ own])
        for own, place in zip(normals[others], start[others], strict=True)
    ]
    return min(meet, key=lambda place: float(np.linalg.norm(place - foot)))


def base_pose(wheel: Wheel, number: int) -> Floats:
    """(4, 4) true pose of an axial burr in the part frame, as :class:`burrscan.inspection.Burr` has it."""
    burr = wheel.burrs[number]
    crest = burr.ridge_mm[len(burr.ridge_mm) // 2]
    foot, normal_zr = _foot(np.array([crest[2], np.hypot(crest[0], crest[1])]), wheel.generatrix_zr_mm)
    angle = np.radians(burr.angle_deg)
    radial = np.array([np.cos(angle), np.sin(angle), 0.0])
    up = np.array([0.0, 0.0, 1.0])
    normal, along = normal_zr[1] * radial + normal_zr[0] * up, normal_zr[1] * up - normal_zr[0] * radial
    pose = np.eye(4)
    pose[:3, :3] = np.stack([along, np.cross(normal, along), normal], axis=1)
    pose[:3, 3] = foot[1] * radial + foot[0] * up
    return pose


def _middle(wheel: Wheel, number: int, z_mm: float) -> float:
    """Angle, rad, of the middle of a burr's outline within a few millimetres of a place along the axis.

    The outline is that of sections: corners of facets lie where the mesher put them, on one flank or other.
    """
    burr = wheel.burrs[number]
    corners = wheel.vertices_mm[wheel.faces[wheel.face_burr == number]]
    start, end = corners.reshape(-1, 3), np.roll(corners, -1, axis=1).reshape(-1, 3)
    low, high = max(burr.z_start_mm, z_mm - _NEAR_MM), min(burr.z_end_mm, z_mm + _NEAR_MM)
    if low >= high:  # beyond its end
        low, high = burr.z_start_mm, burr.z_end_mm
    middles = []
    for level in np.arange(low + 0.5 * _SLICE_MM, high, _SLICE_MM):
        crossing = (start[:, 2] - level) * (end[:, 2] - level) < 0.0
        one, other = start[crossing], end[crossing]
        share = (level - one[:, 2]) / (other[:, 2] - one[:, 2])
        x, y = (one + share[:, None] * (other - one))[:, :2].T
        away = turn_rad(np.arctan2(y, x) - np.radians(burr.angle_deg))
        if away.size:
            middles.append(0.5 * (away.min() + away.max()))
    return float(np.radians(burr.angle_deg) + (np.mean(middles) if middles else 0.0))


def left_of(wheel: Wheel, before: Wheel, burr: TrueBurr) -> Left:
    """What a mill's passes left of one burr of a wheel, that it was before. O(faces near the burr)."""
    near = _near(wheel, burr)
    deviation = deviation_mm(_samples(wheel.vertices_mm, wheel.faces[near]), wheel.generatrix_zr_mm)
    untouched = deviation_mm(
        before.vertices_mm[before.faces[_near(before, burr)]].reshape(-1, 3), wheel.generatrix_zr_mm
    )
    # chamfers and the like were there before
    return Left(float(deviation.max()), float(-(deviation.min() - min(untouched.min(), 0.0))))


def _near(wheel: Wheel, burr: TrueBurr) -> Bools:
    """(T,) faces in the burr's place."""
    middle = wheel.vertices_mm[wheel.faces].mean(axis=1)
    radius = np.hypot(middle[:, 0], middle[:, 1])
    off = np.degrees(np.arctan2(middle[:, 1], middle[:, 0])) - burr.angle_deg
    off_mm = np.abs(np.radians(turn_deg(off))) * radius
    half = 0.5 * np.radians(burr.arc_deg) * radius + 0.5 * burr.width_mm + burr.height_mm + _BESIDE_MM
    low, high = burr.z_start_mm - _BESIDE_MM, burr.z_end_mm + _BESIDE_MM
    outside = radius > 0.5 * float(np.hypot(burr.ridge_mm[:, 0], burr.ridge_mm[:, 1]).min())
    return np.asarray((off_mm < half) & (middle[:, 2] > low) & (middle[:, 2] < high) & outside)


def _samples(vertices: Floats, faces: Ints32) -> Floats:
    """Corners of the faces, and of the pieces that large ones are divided into."""
    corners = vertices[faces]
    pieces = [corners.reshape(-1, 3)]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    for triangle, side in zip(corners[longest > _FINE_MM], longest[longest > _FINE_MM], strict=True):
        count = min(int(np.ceil(side / _FINE_MM)), 40)
        i, j = np.meshgrid(np.arange(count + 1), np.arange(count + 1))
        share = np.stack([i, j], axis=-1)[i + j <= count] / count
        pieces.append(triangle[0] + share @ (triangle[1:] - triangle[0]))
    return np.concatenate(pieces)


def _foot(zr: Floats, curve: Floats) -> tuple[Floats, Floats]:
    """The nearest place on the outline, and the outward normal of its segment."""
    start, step = curve[:-1], np.diff(curve, axis=0)
    along = np.clip(((zr - start) * step).sum(axis=1) / (step**2).sum(axis=1), 0.0, 1.0)
    feet = start + along[:, None] * step
    nearest = int(np.argmin(((feet - zr) ** 2).sum(axis=1)))
    normal = np.array([-step[nearest, 1], step[nearest, 0]])
    return feet[nearest], normal / np.linalg.norm(normal)
