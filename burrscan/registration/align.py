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
from burrscan.pose import placed
from burrscan.registration.alignment import Alignment, Pairs, PosedSurface
from burrscan.registration.cloud import Cloud, clouds_of
from burrscan.registration.judge import Findings, doubts, free_motions
from burrscan.registration.matching import all_pairs, overlaps
from burrscan.registration.solve import Prior, moved, solve, weights

_GATE_SIGMAS, _GATE_SHRINK, _GATE_PITCHES = 3.0, 0.7, 2.0
"""Pairs may be apart by three sigma of the rough poses, then less each round, down to two pitches, within
which neighbours of sampled surfaces lie."""
_PATCH = 8.0
"""In pitches: surroundings that normals come from, and steps that averaging blurs, err together that far."""
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
        Points of each view that are compared with the other views.
    most_iterations
        Of matching and solving; fewer where the poses stop moving.
    seed
        Chooses the samples.

    Raises
    ------
    InputError
        For fewer than two views, a pose that is no rigid motion, or views of hardly any points. A result that
        the views do not support is returned with its ``doubts``: see
        :func:`burrscan.registration.refuse_doubtful`.

    Notes
    -----
    Every view is averaged to the scale at which its shape outweighs its noise
    (:mod:`burrscan.registration.scale`). Each iteration: the nearest point of every other view within a gate
    that shrinks from what the rough poses allow to the resolution; point to plane, Tukey's biweight; one
    Gauss-Newton step for all poses. O(N² S log V) per iteration. The covariance takes distances of one patch
    as dependent, others as independent. All views are alike until the end, when the first is moved back to
    its rough pose and takes the others along: which one is the first changes the frame, not how the views
    lie to each other.

    """
    clouds, rough = _checked(views, samples, seed)
    middle = _middles(clouds, rough).mean(axis=0)
    prior = Prior(rough, np.repeat([np.radians(sigma_deg), sigma_mm], 3) ** -2.0)
    reach = float(np.linalg.norm(rough[:, :3, 3] - middle, axis=1).max())
    pitch = max(cloud.pitch_mm for cloud in clouds)
    wide, least = _GATE_SIGMAS * (sigma_mm + np.radians(sigma_deg) * reach), _GATE_PITCHES * pitch
    size = max(float(np.ptp(cloud.points_mm, axis=0).max()) for cloud in clouds)
    gate, poses, iterations = wide, rough, 0
    while True:
        iterations += 1
        gate = max(gate, least)
        pairs = all_pairs(clouds, poses, gate_mm=gate)
        step = solve(pairs, poses, prior, middle, patch_mm=_PATCH * pitch)
        poses = np.stack([moved(pose, twist, middle) for pose, twist in zip(poses, step.twists, strict=True)])
        travel = np.abs(step.twists[:, :3]).max() * size + np.abs(step.twists[:, 3:]).max()
        if iterations == most_iterations or (gate == least and travel < _STILL * pitch):
            break
        gate *= _GATE_SHRINK
    noise = np.array([cloud.noise_mm for cloud in clouds])
    findings = Findings(
        pairs=pairs,
        noise_mm=noise,
        pitch_mm=pitch,
        before_mm=_distance(all_pairs(clouds, rough, gate_mm=max(wide, least))),
        after_mm=_distance(all_pairs(clouds, poses, gate_mm=max(wide, least))),
        step=float(np.sqrt(step.twists.ravel() @ step.normal @ step.twists.ravel() / step.twists.size)),
        off=np.array([prior.off(pose, number, middle) for number, pose in enumerate(poses)]),
        iterations=iterations,
    )
    poses = (rough[0] @ np.linalg.inv(poses[0])) @ poses
    poses[0] = rough[0]
    covariance, alone = _against_first(step.covariance), _against_first(step.alone)
    return Alignment(
        T_world_camera=poses,
        covariance=covariance,
        moved_mm=np.linalg.norm(_middles(clouds, poses) - _middles(clouds, rough), axis=1).astype(float),
        overlap=overlaps(clouds, poses, gate_mm=least),
        rms_mm=_rms(pairs),
        iterations=iterations,
        floor_mm=_floor(pairs),
        noise_mm=noise,
        working_mm=pitch,
        free=((), *(free_motions(covariance[n], alone[n], middle, 0.5 * size) for n in range(1, len(views)))),
        doubts=doubts(findings),
    )


def _checked(views: Sequence[PosedSurface], samples: int, seed: int) -> tuple[list[Cloud], Floats]:
    if len(views) < 2:
        raise InputError("an alignment needs two views at least")
    named = [(view, f"view {number}") for number, view in enumerate(views, 1)]
    clouds = clouds_of(named, samples=samples, seed=seed)
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


def _against_first(covariance: Floats) -> Floats:
    """(N, 6, 6) covariance of each twist less the first's: zero for the first."""
    count = len(covariance) // 6
    inverse = covariance.reshape(count, 6, count, 6).transpose(0, 2, 1, 3)
    own = np.einsum("iiab->iab", inverse)
    mixed = inverse[0]
    return np.asarray(own + own[0] - mixed - mixed.transpose(0, 2, 1))


def _middles(clouds: Sequence[Cloud], poses: Floats) -> Floats:
    """(N, 3) the middle of what each view shows, in the world frame."""
    return np.stack([placed(pose, c.points_mm.mean(axis=0)) for pose, c in zip(poses, clouds, strict=True)])


def _distance(pairs: Sequence[Pairs]) -> float:
    """Median distance, whatever its weight; NaN where nothing was near."""
    sizes = [np.abs(pair.distance_mm) for pair in pairs]
    return float(np.median(np.concatenate(sizes))) if sizes else float("nan")


def _floor(pairs: Sequence[Pairs]) -> float:
    """What :func:`_rms` would be of noise alone."""
    if not pairs:
        return float("nan")
    weight = np.concatenate([weights(pair) for pair in pairs])
    square = np.concatenate([pair.sigma_mm**2 for pair in pairs])
    return float(np.sqrt(weight @ square / weight.sum()))


def _rms(pairs: Sequence[Pairs]) -> float:
    if not pairs:
        return float("nan")
    weight = np.concatenate([weights(pair) for pair in pairs])
    square = np.concatenate([pair.distance_mm**2 for pair in pairs])
    return float(np.sqrt(weight @ square / weight.sum()))
