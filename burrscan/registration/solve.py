"""One Gauss-Newton step for all poses: distances of the surfaces, and the rough poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from burrscan.arrays import Floats
from burrscan.registration.alignment import Pairs
from burrscan.robust import SIGMA_PER_MEDIAN, TUKEY


@dataclass(frozen=True)
class Prior:
    """What the robot says.

    Parameters
    ----------
    poses
        (N, 4, 4) rough poses.
    precision
        (6,) one over the variance of the rotation vector's parts, rad, and of the camera's place, mm.

    """

    poses: Floats
    precision: Floats

    def equations(self, pose: Floats, number: int, middle_mm: Floats) -> tuple[Floats, Floats]:
        """(6, 6) and (6,) normal equations in a twist (rotation, translation) about ``middle_mm``."""
        rough = self.poses[number]
        turned = Rotation.from_matrix(pose[:3, :3] @ rough[:3, :3].T).as_rotvec()
        jacobian = np.eye(6)
        jacobian[3:, :3] = -_cross(pose[:3, 3] - middle_mm)
        off = np.concatenate([turned, pose[:3, 3] - rough[:3, 3]])
        weighted = jacobian.T * self.precision
        return weighted @ jacobian, -weighted @ off


def solve(pairs: Sequence[Pairs], poses: Floats, prior: Prior, middle_mm: Floats) -> tuple[Floats, Floats]:
    """The normal matrix (6N, 6N) and the twists (N, 6) that it wants.

    Notes
    -----
    Weights: one over the variance, which is raised where a pair of views disagrees by more than it states
    (median absolute deviation), times Tukey's biweight. O(pairs).

    """
    count = len(poses)
    normal, wanted = np.zeros((6 * count, 6 * count)), np.zeros(6 * count)
    for number in range(count):
        block = _block(number)
        normal[block, block], wanted[block] = prior.equations(poses[number], number, middle_mm)
    for pair in pairs:
        _add(normal, wanted, pair, middle_mm)
    return normal, np.asarray(np.linalg.solve(normal, wanted)).reshape(count, 6)


def moved(pose: Floats, twist: Floats, middle_mm: Floats) -> Floats:
    """A pose turned and shifted by a twist about a point."""
    turn = Rotation.from_rotvec(twist[:3]).as_matrix()
    changed = np.eye(4)
    changed[:3, :3] = turn @ pose[:3, :3]
    changed[:3, 3] = turn @ (pose[:3, 3] - middle_mm) + middle_mm + twist[3:]
    return changed


def weights(pair: Pairs) -> Floats:
    """(M,) weights of the distances, 1/mm²."""
    z = pair.distance_mm / pair.sigma_mm
    spread = max(SIGMA_PER_MEDIAN * float(np.median(np.abs(z))), 1.0)
    inside = np.clip(1.0 - (z / (TUKEY * spread)) ** 2, 0.0, None) ** 2
    return np.asarray(inside / (spread * pair.sigma_mm) ** 2)


def _add(normal: Floats, wanted: Floats, pair: Pairs, middle_mm: Floats) -> None:
    jacobian = np.concatenate([np.cross(pair.points_mm - middle_mm, pair.normals), pair.normals], axis=1)
    weighted = jacobian * weights(pair)[:, None]
    square, pull = weighted.T @ jacobian, weighted.T @ pair.distance_mm
    one, other = _block(pair.moving), _block(pair.fixed)
    normal[one, one] += square
    normal[other, other] += square
    normal[one, other] -= square
    normal[other, one] -= square
    wanted[one] -= pull
    wanted[other] += pull


def _block(number: int) -> slice:
    return slice(6 * number, 6 * number + 6)


def _cross(vector: Floats) -> Floats:
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
