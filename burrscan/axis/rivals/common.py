"""What the rivals share: patches with normals to start from, and an axis without a covariance to end with."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats
from burrscan.axis.basis import sensed
from burrscan.axis.points.cloud import Cloud, canonical_cloud, voxel_moments
from burrscan.axis.points.surfels import Surfels, surfels_of
from burrscan.inspection import Axis


def patches(vertices_mm: Floats, sigma_mm: Floats | None) -> tuple[Cloud, Surfels]:
    """The canonical cloud and its surfels that have a normal (face normals are too noisy for the rivals)."""
    cloud = canonical_cloud(vertices_mm, sigma_mm)
    surfels = surfels_of(*voxel_moments(cloud.points, cloud.weights))
    good = surfels.weights > 0.0
    return cloud, Surfels(surfels.points[good], surfels.normals[good], surfels.weights[good])


def bare_axis(cloud: Cloud, direction: Floats, place: Floats, method: str, evaluations: int) -> Axis:
    """An axis given in the canonical frame, in the frame of the mesh, with no covariance stated."""
    a = sensed(cloud.rotation @ (direction / np.linalg.norm(direction)))
    point = cloud.rotation @ place
    point = cloud.mean_mm + cloud.scale_mm * (point - a * (a @ point))
    return Axis(point, a, np.full((4, 4), np.nan), method, evaluations)
