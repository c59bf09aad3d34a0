"""Wheels and measures that the tests of scenes.wheel share."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats, Ints, Ints32
from scenes.wheel import Wheel, WheelSpec

CYLINDER = WheelSpec("cylinder", ((-30.0, 0.0), (-30.0, 100.0), (30.0, 100.0), (30.0, 0.0)))
RING = WheelSpec("ring", ((-10.0, 50.0, 2.0), (-10.0, 80.0, 3.0), (10.0, 80.0, 3.0), (10.0, 50.0, 2.0)))
STEPPED = WheelSpec(
    "stepped",
    (
        (-30.0, 20.0),
        (-30.0, 80.0, 1.0),
        (0.0, 80.0, 2.0),
        (0.0, 100.0, 1.0),
        (30.0, 100.0, 1.0),
        (30.0, 20.0),
    ),
)


def edge_counts(faces: Ints | Ints32) -> tuple[bool, bool]:
    """Whether every edge has two faces, and whether these run along it in opposite senses."""
    directed = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    key = directed[:, 0] * (faces.max() + 1) + directed[:, 1]
    back = directed[:, 1] * (faces.max() + 1) + directed[:, 0]
    paired = np.array_equal(np.sort(key), np.sort(back))
    return paired, len(np.unique(key)) == len(key)


def volume_mm3(wheel: Wheel) -> float:
    """By the divergence theorem."""
    a, b, c = (wheel.vertices_mm[wheel.faces[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


def face_normals(wheel: Wheel) -> tuple[Floats, Floats]:
    """Unit normals and areas."""
    a, b, c = (wheel.vertices_mm[wheel.faces[:, i]] for i in range(3))
    cross = np.cross(b - a, c - a)
    length = np.linalg.norm(cross, axis=1)
    return cross / np.maximum(length, 1e-300)[:, None], length / 2.0


def sampled_points(wheel: Wheel, faces: Ints, *, per_face: int, seed: int = 0) -> Floats:
    """Random points of the faces."""
    rng = np.random.default_rng(seed)
    shares = rng.dirichlet([1.0, 1.0, 1.0], size=(len(faces), per_face))
    points: Floats = np.einsum("fpc,fci->fpi", shares, wheel.vertices_mm[wheel.faces[faces]])
    return points.reshape(-1, 3)


def radii_met(wheel: Wheel, angle_rad: float, z_mm: float) -> Floats:
    """Radii at which a radial ray meets the surface, from outside inwards, by Möller and Trumbore's test."""
    return _radii_met(_at_height(wheel, z_mm), angle_rad, z_mm)


def largest_radius(wheel: Wheel, angles_rad: Floats, z_mm: float) -> float:
    """Of the places that radial rays at these angles meet first."""
    corners = _at_height(wheel, z_mm)
    return max(float(_radii_met(corners, float(angle), z_mm)[0]) for angle in angles_rad)


def _at_height(wheel: Wheel, z_mm: float) -> Floats:
    """Corners (faces, 3, 3) of the faces that a plane across the axis cuts."""
    z = wheel.vertices_mm[:, 2][wheel.faces]
    near = (z.min(axis=1) <= z_mm) & (z.max(axis=1) >= z_mm)
    return np.asarray(wheel.vertices_mm[wheel.faces[near]])


def _radii_met(corners: Floats, angle_rad: float, z_mm: float) -> Floats:
    outwards = np.array([np.cos(angle_rad), np.sin(angle_rad), 0.0])
    a, b, c = corners[(corners @ outwards).max(axis=1) > 0.0].transpose(1, 0, 2)
    start = 200.0 * outwards + np.array([0.0, 0.0, z_mm])
    across = np.cross(-outwards, c - a)
    determinant = np.einsum("ij,ij->i", b - a, across)
    determinant[determinant == 0.0] = np.inf
    u = np.einsum("ij,ij->i", start - a, across) / determinant
    other = np.cross(start - a, b - a)
    v = other @ -outwards / determinant
    met = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & np.isfinite(determinant)
    way = np.einsum("ij,ij->i", c - a, other)[met] / determinant[met]
    return np.asarray(np.sort(200.0 - way)[::-1])
