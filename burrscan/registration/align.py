"""All views at once: point to plane between every two that overlap, and the robot's word for what is open.

Chen & Medioni (1992) for the distance; Pulli (1999) and Lu & Milios (1997) for solving all poses together, so
that errors do not add up around the part. A surface of revolution slides along itself when it turns about its
axis: no distance sees that turn but at burrs, spokes and edges of other shape. The rough poses therefore stay
in the problem with their stated uncertainty, and decide exactly what the surfaces leave open.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from burrscan.arrays import Floats
from burrscan.errors import InputError
from burrscan.registration.alignment import Alignment, Pairs, PosedSurface
from burrscan.registration.cloud import Cloud, cloud_of
from burrscan.registration.matching import all_pairs, placed
from burrscan.registration.solve import Prior, moved, solve, weights

_GATE_SIGMAS, _GATE_SHRINK, _GATE_PITCHES = 3.0, 0.7, 2.0
"""Pairs may be apart by three sigma of the rough poses, then less each round, down to two pitches, within
which neighbours of sampled surfaces lie."""
_STILL = 1e-3
"""Done when no view moves by more than this share of its neighbouring vertices' distance."""
_RIGID = 1e-6
"""Largest entry of R Rᵀ off the diagonal: poses written with seven decimals pass, a shear does not."""


def align(
    views: Sequence[PosedSurface],
    *,
    sigma_mm: float = 0.5,
    sigma_deg: float = 0.2,
    samples: int = 8_000,
    most_iterations: int = 60,
    seed: int = 0,
) -> Alignment:
    """Find the poses of several views of one part.

    Parameters
    ----------
    views
        At least two, with their rough poses.
    sigma_mm, sigma_deg
        Standard deviation of every rough pose along and about each of its axes, at the camera: what the
        robot's maker states, or a hand-eye calibration left.
    samples
        Vertices of each view that are compared with the other views.
    most_iterations
        Of matching and solving; fewer where the poses stop moving.
    seed
        Chooses the samples.

    Raises
    ------
    InputError
        For fewer than two views, a pose that is no rigid motion, or views that hold no mesh.

    Notes
    -----
    Each iteration: the nearest vertex of every other view within a gate that shrinks from what the rough
    poses allow to the resolution; point to plane, Tukey's biweight; one Gauss-Newton step for all poses.
    O(N² S log V) per iteration. The covariance takes the noise of neighbouring samples as independent. All
    views are alike until the end, when the first is moved back to its rough pose and takes the others along:
    which one is the first changes the frame, not how the views lie to each other.

    """
    clouds, rough = _checked(views, samples, seed)
    middle = _middles(clouds, rough).mean(axis=0)
    prior = Prior(rough, np.repeat([np.radians(sigma_deg), sigma_mm], 3) ** -2.0)
    reach = float(np.linalg.norm(rough[:, :3, 3] - middle, axis=1).max())
    pitch = max(cloud.pitch_mm for cloud in clouds)
    gate, least = _GATE_SIGMAS * (sigma_mm + np.radians(sigma_deg) * reach), _GATE_PITCHES * pitch
    size = max(float(np.ptp(cloud.points_mm, axis=0).max()) for cloud in clouds)
    poses, pairs, normal, iterations = rough, list[Pairs](), np.eye(6 * len(views)), 0
    while iterations < most_iterations:
        iterations += 1
        gate = max(gate, least)
        pairs = all_pairs(clouds, poses, gate_mm=gate)
        normal, twists = solve(pairs, poses, prior, middle)
        poses = np.stack([moved(pose, twist, middle) for pose, twist in zip(poses, twists, strict=True)])
        travel = np.abs(twists[:, :3]).max() * size + np.abs(twists[:, 3:]).max()
        if gate == least and travel < _STILL * pitch:
            break
        gate *= _GATE_SHRINK
    poses = (rough[0] @ np.linalg.inv(poses[0])) @ poses
    poses[0] = rough[0]
    return Alignment(
        T_world_camera=poses,
        covariance=_against_first(normal),
        moved_mm=np.linalg.norm(_middles(clouds, poses) - _middles(clouds, rough), axis=1).astype(float),
        overlap=_overlap(pairs, [len(cloud.samples) for cloud in clouds]),
        rms_mm=_rms(pairs),
        iterations=iterations,
    )


def _checked(views: Sequence[PosedSurface], samples: int, seed: int) -> tuple[list[Cloud], Floats]:
    if len(views) < 2:
        raise InputError("an alignment needs two views at least")
    clouds = [
        cloud_of(view, samples=samples, rng=np.random.default_rng(seed), name=f"view {n}")
        for n, view in enumerate(views, 1)
    ]
    return clouds, np.stack([_rigid(view.T_world_camera, number) for number, view in enumerate(views, 1)])


def _rigid(pose: Floats, number: int) -> Floats:
    matrix = np.asarray(pose, dtype=float)
    if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
        raise InputError(f"view {number}: its pose is no 4×4 matrix of numbers")
    rotation = matrix[:3, :3]
    straight = np.allclose(rotation @ rotation.T, np.eye(3), atol=_RIGID) and np.linalg.det(rotation) > 0.0
    if not (straight and np.array_equal(matrix[3], [0.0, 0.0, 0.0, 1.0])):
        raise InputError(
            f"view {number}: its pose is no rigid motion (rotation, translation, last row 0 0 0 1)"
        )
    return matrix


def _against_first(normal: Floats) -> Floats:
    """(N, 6, 6) covariance of each twist less the first's: zero for the first."""
    count = len(normal) // 6
    inverse = np.linalg.inv(normal).reshape(count, 6, count, 6).transpose(0, 2, 1, 3)
    own = np.einsum("iiab->iab", inverse)
    mixed = inverse[0]
    return np.asarray(own + own[0] - mixed - mixed.transpose(0, 2, 1))


def _middles(clouds: Sequence[Cloud], poses: Floats) -> Floats:
    """(N, 3) the middle of what each view shows, in the world frame."""
    return np.stack([placed(pose, c.points_mm.mean(axis=0)) for pose, c in zip(poses, clouds, strict=True)])


def _overlap(pairs: Sequence[Pairs], samples: Sequence[int]) -> Floats:
    share = np.zeros((len(samples), len(samples)))
    for pair in pairs:
        share[pair.moving, pair.fixed] = len(pair.samples) / samples[pair.moving]
    return share


def _rms(pairs: Sequence[Pairs]) -> float:
    if not pairs:
        return float("nan")
    weight = np.concatenate([weights(pair) for pair in pairs])
    square = np.concatenate([pair.distance_mm**2 for pair in pairs])
    return float(np.sqrt(weight @ square / weight.sum()))
