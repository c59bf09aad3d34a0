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
