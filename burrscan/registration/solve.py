"""One Gauss-Newton step for all poses: distances of the surfaces, and the rough poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation

from burrscan.arrays import Floats
from burrscan.pose import cross_matrix
from burrscan.registration.alignment import Pairs
from burrscan.robust import SIGMA_PER_MEDIAN, TUKEY, bisquare

_SIGNIFICANT = 3.0
"""What is told of a motion must be this many times what noise feigns of it, whose variance is known to some
ten per cent only."""
_TRACE = 1e-6
"""Of the rough poses' precision: keeps the metric regular where noise feigns nothing."""
_BOTH_WAYS = 0.5
"""Weight of a distance: from view i to j and from j to i are two looks at the same noise."""


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
        jacobian[3:, :3] = -cross_matrix(pose[:3, 3] - middle_mm)
        off = np.concatenate([turned, pose[:3, 3] - rough[:3, 3]])
        weighted = jacobian.T * self.precision
        return weighted @ jacobian, -weighted @ off

    def off(self, pose: Floats, number: int, middle_mm: Floats) -> float:
        """How far a pose is from its rough one, in standard deviations."""
        normal, pull = self.equations(pose, number, middle_mm)
        return float(np.sqrt(pull @ np.linalg.solve(normal, pull)))


class Step(NamedTuple):
    """One step for all poses.

    Parameters
    ----------
    twists
        (N, 6) wanted.
    normal
        (6N, 6N) the matrix they come from.
    covariance
        (6N, 6N) of the poses.
    alone
        (6N, 6N) covariance that the rough poses have without the surfaces.

    """

    twists: Floats
    normal: Floats
    covariance: Floats
    alone: Floats


def solve(pairs: Sequence[Pairs], poses: Floats, prior: Prior, middle_mm: Floats, *, patch_mm: float) -> Step:
    """The twists that surfaces and rough poses want together, and how well they are known.

    Notes
    -----
    Weights: one over the variance, which is raised where a pair of views disagrees by more than it states
    (median absolute deviation), times Tukey's biweight; half of it, for every two views are compared both
    ways; less where distances within patches of ``patch_mm`` err together. O(pairs).

    Noise in the normals feigns information about motions along the surface, such as the turn of a round part,
    by as much as their variance says (errors in variables; Fuller 1987). What is told is taken off by that.
    Motions of which no more than noise is told (:data:`_SIGNIFICANT`) are left to the rough poses altogether:
    else noise, which has no stiffness against it there, would turn the part.

    """
    count = len(poses)
    known, wanted = np.zeros((6 * count, 6 * count)), np.zeros(6 * count)
    told, feigned, pull = np.zeros_like(known), np.zeros_like(known), np.zeros_like(wanted)
    shaken = np.zeros_like(known)
    for number in range(count):
        block = _block(number)
        known[block, block], wanted[block] = prior.equations(poses[number], number, middle_mm)
    looks = [(pair, _Rows(pair, middle_mm)) for pair in pairs]
    for pair, rows in looks:
        _spread_out(told, pair, rows.square)
        _spread_out(feigned, pair, rows.feigned)
        pull[_block(pair.moving)] -= rows.pull
        pull[_block(pair.fixed)] += rows.pull
    for pair, square in _shaken(looks, patch_mm):
        _spread_out(shaken, pair, square)
    kept = _significant(told - feigned, feigned + _TRACE * known)
    told, feigned, shaken, pull = (
        kept @ (told - feigned) @ kept.T,
        *(kept @ matrix @ kept.T for matrix in (feigned, shaken)),
        kept @ pull,
    )
    normal = known + told + feigned
    inverse = np.linalg.inv(known + told)
    return Step(
        twists=np.asarray(np.linalg.solve(normal, wanted + pull)).reshape(count, 6),
        normal=normal,
        covariance=inverse @ (known + shaken) @ inverse,
        alone=np.asarray(np.linalg.inv(known)),
    )


def _significant(told: Floats, metric: Floats) -> Floats:
    """(6N, 6N) takes motions out of pulls of which hardly more than noise is told."""
    share, motions = eigh(told, metric)
    kept = np.where(share > _SIGNIFICANT, 1.0, 0.0)
    return np.asarray((metric @ motions * kept) @ motions.T)


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
    inside = bisquare(z / (TUKEY * spread))
    return np.asarray(inside / (spread * pair.sigma_mm) ** 2)


class _Rows:
    """The normal equations of two views' distances, in the twist of one against the other.

    Parameters
    ----------
    pair, middle_mm
        What is compared, and where twists turn about.

    """

    def __init__(self, pair: Pairs, middle_mm: Floats) -> None:
        self.lever = pair.points_mm - middle_mm
        self.jacobian = np.concatenate([np.cross(self.lever, pair.normals), pair.normals], axis=1)
        weight = _BOTH_WAYS * weights(pair)
        self.scores = self.jacobian * (weight * pair.distance_mm)[:, None]
        self.square = (self.jacobian.T * weight) @ self.jacobian
        self.pull = self.scores.sum(axis=0)
        self.feigned = _feigned(self.lever, self.jacobian, weight * pair.lean)


def _spread_out(matrix: Floats, pair: Pairs, square: Floats) -> None:
    """Add a (6, 6) matrix of the twist between two views to that of all poses."""
    one, other = _block(pair.moving), _block(pair.fixed)
    matrix[one, one] += square
    matrix[other, other] += square
    matrix[one, other] -= square
    matrix[other, one] -= square


def _shaken(looks: Sequence[tuple[Pairs, _Rows]], patch_mm: float) -> list[tuple[Pairs, Floats]]:
    """Per two views the covariance (6, 6) of what their distances pull, where those of a patch err together.

    The sum of what every patch pulls, squared (Liang & Zeger 1986), and in no direction less than that of
    distances that know nothing of each other.
    """
    both: dict[tuple[int, int], list[tuple[Pairs, _Rows]]] = {}
    for look in looks:
        pair = look[0]
        both.setdefault((min(pair.moving, pair.fixed), max(pair.moving, pair.fixed)), []).append(look)
    found = []
    for of_two in both.values():
        first = of_two[0][0]
        square = np.sum([rows.square for _, rows in of_two], axis=0)
        # the same noise seen the other way round pulls the other view
        scores = np.concatenate(
            [rows.scores if pair.moving == first.moving else -rows.scores for pair, rows in of_two]
        )
        patch = np.floor(np.concatenate([rows.lever for _, rows in of_two]) / patch_mm).astype(np.int64)
        patch -= patch.min(axis=0)
        number = np.unique(np.ravel_multi_index(patch.T, patch.max(axis=0) + 1), return_inverse=True)[1]
        pulls = np.stack([np.bincount(number, scores[:, k]) for k in range(6)], axis=1)
        metric = square + np.finfo(float).eps * np.trace(square) * np.eye(6)
        size, motions = eigh(pulls.T @ pulls, metric)
        back = metric @ motions
        found.append((first, (back * np.maximum(size, 1.0)) @ back.T))
    return found


def _feigned(lever: Floats, jacobian: Floats, weight: Floats) -> Floats:
    """(6, 6) weighted sum of the covariances of (lever × normal, normal) by normals that lean.

    A normal leans alike in all directions but its own: with B = ([lever]×, 1) it is B Bᵀ less what the normal
    itself, the row of the ``jacobian``, would give.
    """
    square = (lever.T * weight) @ lever
    cross, total = cross_matrix(weight @ lever), weight.sum()
    every = np.block(
        [[np.trace(square) * np.eye(3) - square, cross], [cross.T, total * np.eye(3)]],
    )
    return np.asarray(every - (jacobian.T * weight) @ jacobian)


def _block(number: int) -> slice:
    return slice(6 * number, 6 * number + 6)
