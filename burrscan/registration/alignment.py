"""What goes into an alignment of views, and what comes out."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from burrscan.arrays import Floats, Ints, Ints32, freeze


@dataclass(frozen=True)
class PosedSurface:
    """One view of a part, and roughly where it was taken from.

    Parameters
    ----------
    vertices_mm, faces
        (V, 3) and (T, 3) mesh in the view's own camera frame; faces counter-clockwise seen from the camera. A
        cloud has no faces.
    sigma_mm
        (V,) standard deviation of the vertices, NaN where nothing is known of it.
    T_world_camera
        (4, 4) rough pose, as a robot arm knows it.

    """

    vertices_mm: Floats
    faces: Ints32
    sigma_mm: Floats
    T_world_camera: Floats

    def __post_init__(self) -> None:
        freeze(self, vertices_mm=self.vertices_mm, sigma_mm=self.sigma_mm, T_world_camera=self.T_world_camera)


@dataclass(frozen=True)
class Free:
    """A motion of a view that the surfaces leave to the rough poses.

    Parameters
    ----------
    kind
        ``"turn"`` about a line, which may go with a shift along it, or ``"shift"``.
    point_mm, direction
        (3,) the line of a turn, or the direction of a shift, in the world frame.
    sigma
        Standard deviation of that motion: degrees of a turn, mm of a shift.

    """

    kind: Literal["turn", "shift"]
    point_mm: Floats
    direction: Floats
    sigma: float

    def __post_init__(self) -> None:
        freeze(self, point_mm=self.point_mm, direction=self.direction)

    def __str__(self) -> str:
        """In words."""
        x, y, z = (f"{value:.3f}" for value in self.direction)
        if self.kind == "shift":
            return f"shift along ({x}, {y}, {z}), ± {self.sigma:.3f} mm"
        u, v, w = (f"{value:.1f}" for value in self.point_mm)
        return f"turn about ({x}, {y}, {z}) through ({u}, {v}, {w}), ± {self.sigma:.3f} deg"


@dataclass(frozen=True)
class Alignment:
    """The poses of all views.

    Parameters
    ----------
    T_world_camera
        (N, 4, 4). The first view keeps its rough pose: it is the frame of the others.
    covariance
        (N, 6, 6) of each pose against the first: rotation vector in rad, then translation in mm, both of the
        part's middle in the world frame. Zero for the first.
    moved_mm
        (N,) how far the alignment moved the middle of each view.
    overlap
        (N, N) share of view i that view j shows as well.
    rms_mm
        Weighted root mean square distance, point to plane, of what was compared.
    iterations
        How many it took.
    floor_mm
        What ``rms_mm`` would be of noise alone.
    noise_mm
        (N,) standard deviation of a view's own points across its surface, as they show it.
    working_mm
        Distance of the points that were compared: finer ones are averaged where noise is thicker.
    free
        Per view the motions against the first that the rough poses decide, not the surfaces.
    doubts
        Why this is no result, one sentence each; empty where nothing speaks against it.

    """

    T_world_camera: Floats
    covariance: Floats
    moved_mm: Floats
    overlap: Floats
    rms_mm: float
    iterations: int
    floor_mm: float = float("nan")
    noise_mm: Floats = field(default_factory=lambda: np.zeros(0))
    working_mm: float = float("nan")
    free: tuple[tuple[Free, ...], ...] = ()
    doubts: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        freeze(self, T_world_camera=self.T_world_camera, covariance=self.covariance, overlap=self.overlap)
        freeze(self, moved_mm=self.moved_mm, noise_mm=self.noise_mm)


@dataclass(frozen=True)
class Pairs:
    """Points of one view beside their nearest places on another, in the world frame.

    Parameters
    ----------
    moving, fixed
        Indices of the two views.
    points_mm, normals
        (M, 3) halfway between the surroundings of point and place, and the mean of their normals.
    distance_mm
        (M,) from place to point along that normal.
    sigma_mm
        (M,) standard deviation of that distance.
    lean
        (M,) variance of the normal in either direction across it, rad², that noise makes.
    samples
        (M,) which of the moving view's samples they are.

    """

    moving: int
    fixed: int
    points_mm: Floats
    normals: Floats
    distance_mm: Floats
    sigma_mm: Floats
    lean: Floats
    samples: Ints
