"""What goes into an alignment of views, and what comes out."""

from __future__ import annotations

from dataclasses import dataclass

from burrscan.arrays import Floats, Ints, Ints32, freeze


@dataclass(frozen=True)
class PosedSurface:
    """One view of a part, and roughly where it was taken from.

    Parameters
    ----------
    vertices_mm, faces
        (V, 3) and (T, 3) mesh in the view's own camera frame; faces counter-clockwise seen from the camera.
    sigma_mm
        (V,) standard deviation of the vertices.
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
        (N, N) share of the samples of view i that were compared with view j.
    rms_mm
        Weighted root mean square distance, point to plane, of what was compared.
    iterations
        How many it took.

    """

    T_world_camera: Floats
    covariance: Floats
    moved_mm: Floats
    overlap: Floats
    rms_mm: float
    iterations: int

    def __post_init__(self) -> None:
        freeze(self, T_world_camera=self.T_world_camera, covariance=self.covariance, overlap=self.overlap)


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
    samples
        (M,) which of the moving view's samples they are.

    """

    moving: int
    fixed: int
    points_mm: Floats
    normals: Floats
    distance_mm: Floats
    sigma_mm: Floats
    samples: Ints
