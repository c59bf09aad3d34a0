"""Which places of two views are the same: the nearest ones that look the same way.

The distance is measured along the mean of the two normals (Rusinkiewicz 2019): between two vertices of one
curved surface it is then zero, where a plane through one of them would be off by the sagitta. The lever of
that normal is the middle of the surroundings that it was found in, not the vertex: noise along an oblique ray
moves the vertex sideways as well as off the surface. Lever and distance would have their errors in common,
and round views would creep about their axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations

import numpy as np

from burrscan.arrays import Floats
from burrscan.pose import placed
from burrscan.registration.alignment import Pairs
from burrscan.registration.cloud import Cloud

_SAME_SIDE = 0.8
"""Cosine between the normals of what is compared, at least: an edge's two faces are two surfaces."""
_BESIDE = 1.0
"""In pitches: nearest points of one surface lie no farther apart, sideways, but for a view's last row."""


def all_pairs(clouds: Sequence[Cloud], poses: Floats, *, gate_mm: float) -> list[Pairs]:
    """The samples of every view against every other view that is within the gate. O(N² S log V)."""
    numbers = permutations(range(len(clouds)), 2)
    found = (_pairs(clouds, poses, moving, fixed, gate_mm) for moving, fixed in numbers)
    return [pairs for pairs in found if len(pairs.samples)]


def overlaps(clouds: Sequence[Cloud], poses: Floats, *, gate_mm: float) -> Floats:
    """(N, N) share of the points of view i that lie on what view j shows, edges and rims included."""
    share = np.zeros((len(clouds), len(clouds)))
    for moving, fixed in permutations(range(len(clouds)), 2):
        one, other = clouds[moving], clouds[fixed]
        rotation, origin = poses[fixed][:3, :3], poses[fixed][:3, 3]
        local = (placed(poses[moving], one.points_mm[one.samples]) - origin) @ rotation
        distance, nearest = other.tree.query(local, distance_upper_bound=gate_mm)
        distance, near = np.asarray(distance), np.isfinite(distance)
        index = np.asarray(nearest)[near]
        across = np.einsum("ij,ij->i", local[near] - other.points_mm[index], other.normals[index])
        sideways = np.sqrt(np.maximum(distance[near] ** 2 - across**2, 0.0))
        count = one.count[one.samples]
        beside = sideways < _BESIDE * other.pitch_mm
        share[moving, fixed] = count[near] @ beside / count.sum()
    return share


def _pairs(clouds: Sequence[Cloud], poses: Floats, moving: int, fixed: int, gate_mm: float) -> Pairs:
    one, other = clouds[moving], clouds[fixed]
    points = placed(poses[moving], one.points_mm[one.samples])
    rotation, origin = poses[fixed][:3, :3], poses[fixed][:3, 3]
    distance, nearest = other.tree.query((points - origin) @ rotation, distance_upper_bound=gate_mm)
    near = np.flatnonzero(np.isfinite(distance))
    nearest = np.asarray(nearest)[near]
    theirs = other.normals[nearest] @ rotation.T
    own = one.normals[one.samples[near]] @ poses[moving][:3, :3].T
    along = np.einsum("ij,ij->i", own, theirs)
    if not (one.oriented and other.oriented):  # a cloud's normals point either way
        theirs, along = theirs * np.where(along < 0.0, -1.0, 1.0)[:, None], np.abs(along)
    same = ~(other.rim[nearest] | one.rim[one.samples[near]]) & (along > _SAME_SIDE)
    near, nearest, normals = near[same], nearest[same], own[same] + theirs[same]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    mine = one.samples[near]
    place = placed(poses[fixed], other.points_mm[nearest])
    shared = np.bincount(nearest, minlength=len(other.points_mm))[nearest]
    levers = 0.5 * (
        placed(poses[moving], one.middles_mm[mine]) + placed(poses[fixed], other.middles_mm[nearest])
    )
    return Pairs(
        moving,
        fixed,
        points_mm=levers,
        normals=normals,
        distance_mm=np.einsum("ij,ij->i", points[near] - place, normals),
        # a point that several are compared with brings its noise to all of them
        sigma_mm=np.sqrt(one.sigma_mm[mine] ** 2 + shared * other.sigma_mm[nearest] ** 2),
        lean=0.25 * (one.lean[mine] + other.lean[nearest]),
        samples=near,
    )
