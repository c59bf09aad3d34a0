"""The burr by the seed paper's method (section 4): one angle, from where each circle is left the farthest."""

from __future__ import annotations

import dataclasses
from typing import Literal

import numpy as np
from numba import njit
from scipy.special import ndtri
from scipy.stats import binom

from burrscan.arrays import Bools, Floats, Ints32
from burrscan.axis.basis import T_part_mesh
from burrscan.burrs.describe import Site, describe
from burrscan.burrs.field import field_of
from burrscan.burrs.height import judged
from burrscan.inspection import Axis, Burr, Generatrix, Value, side_of
from burrscan.pose import placed
from burrscan.turns import turn_rad

_CIRCLE_ITERATIONS = 5
"""RANSAC rounds per circle: the paper's five."""
_CIRCLE_TOLERANCE_MM = 1.0
"""Both from section 3.2 of the paper."""
_UNKNOWN = Value(float("nan"), float("nan"))


def burrs_seed(
    vertices_mm: Floats,
    faces: Ints32,
    axis: Axis,
    generatrix: Generatrix,
    *,
    sigma_mm: Floats | float | None = None,
    limit_mm: float | None = None,
    planes: int = 10,
    tolerance_deg: float = 5.0,
    iterations: int = 4,
    seed: int = 0,
    half_turn: Literal["kept", "lost"] = "kept",
) -> tuple[Burr, ...]:
    """Find the one burr, parallel to the axis, that the paper assumes.

    On each of ``planes - 1`` circles the angle of the point farthest from the circle is taken; RANSAC with
    samples of one finds the angle that most circles agree on; the mean of those that agree is the burr's
    angle.

    Parameters
    ----------
    vertices_mm, faces, axis, generatrix, sigma_mm, limit_mm
        As for :func:`burrscan.burrs.residual.burrs_residual`.
    planes
        P of the paper.
    tolerance_deg
        t of the paper, 5π/180.
    iterations
        N of the paper: a quarter of the angles wrong, 99 % to hit a right one.
    seed
        Of the random choices.
    half_turn
        Lost where the arctangent of one argument, as printed, cannot tell an angle from the opposite one.

    Returns
    -------
    tuple of Burr
        Always one, as in the paper, whose answer has no "none"; its ``significance`` says whether to believe
        it: how unlikely (in sigma, the N choices allowed for) so many circles agree by chance. Empty only
        where no plane meets a face.

    Notes
    -----
    Kept: the maximum of the distance's amount (a nick is found too), RANSAC, N, t. Mended, as the paper's
    formula cannot work: angles are atan2's (its tan⁻¹ loses half a turn) and are averaged as directions (a
    plain mean breaks at ±180°). Height and extent are not in the paper: they come from the residual within
    ``tolerance_deg`` of the angle, and are NaN where none rises there. O(V + T).

    """
    angles, signed = _farthest(vertices_mm, faces, axis, planes, np.random.default_rng(seed))
    if not len(angles):
        return ()
    if half_turn == "lost":
        angles = np.arctan(np.tan(angles))
    agree = agreeing(angles, np.radians(tolerance_deg), iterations, np.random.default_rng(seed + 1))
    angle = float(np.angle(np.exp(1j * angles[agree]).sum()))
    field = field_of(vertices_mm, faces, axis, generatrix, sigma_mm=sigma_mm)
    chance = min(2.0 * np.radians(tolerance_deg) / field.arc[1], 1.0)
    significance = _significance(int(agree.sum()), len(angles), chance, iterations)
    turn = np.abs(turn_rad(field.angle - angle))
    chosen = np.flatnonzero(turn < 2.0 * np.radians(tolerance_deg))
    on = turn[chosen] < np.radians(tolerance_deg)
    sign = 1 if np.median(signed[agree]) >= 0.0 else -1
    burr = describe(field, Site(chosen, on, sign, significance), axis)
    stated = _with_angle(burr or _angle_only(sign, significance), angle, angles[agree], axis)
    return (judged(stated, limit_mm),)


def burrs_seed_literal(
    vertices_mm: Floats,
    faces: Ints32,
    axis: Axis,
    generatrix: Generatrix,
    *,
    sigma_mm: Floats | float | None = None,
    limit_mm: float | None = None,
    seed: int = 0,
) -> tuple[Burr, ...]:
    """Find the burr as printed: :func:`burrs_seed` with α = tan⁻¹(y / x) of one argument.

    A burr on the half x < 0 of the part frame is so stated half a turn away. The paper counts its angles in
    the frame rotated back from (θ, φ), which depends on how the scanner stood; here it is the part frame.
    """
    return burrs_seed(
        vertices_mm,
        faces,
        axis,
        generatrix,
        sigma_mm=sigma_mm,
        limit_mm=limit_mm,
        seed=seed,
        half_turn="lost",
    )


def _farthest(
    vertices_mm: Floats, faces: Ints32, axis: Axis, planes: int, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    """Angle of the farthest point of each circle, about its own centre, and its signed distance."""
    transform = T_part_mesh(axis.point_mm, axis.direction)
    bags = _bags(placed(transform, vertices_mm), faces, planes)
    angles, signed = [], []
    for points in bags:
        if len(points) < 4:
            continue
        centre, radius = _circle(points, rng)
        offset = points - centre
        distance = np.hypot(*offset.T) - radius
        farthest = int(np.argmax(np.abs(distance)))
        angles.append(np.arctan2(offset[farthest, 1], offset[farthest, 0]))
        signed.append(distance[farthest])
    return np.array(angles), np.array(signed)


def _bags(points: Floats, faces: Ints32, planes: int) -> list[Floats]:
    """The paper's layer trick: (x, y) of the mean corner of every triangle that each inner plane cuts."""
    z = points[:, 2]
    low, high = np.nanmin(z), np.nanmax(z)
    layer = (z - low) / ((high - low) / planes)
    if not len(faces):
        # A cloud has no triangles: its vertices within a twentieth of a layer of the plane stand for them.
        nearest = np.round(layer)
        near = np.abs(layer - nearest) < 0.05
        return [points[near & (nearest == i), :2] for i in range(1, planes)]
    plane = _planes_cut(layer, faces)
    cut = plane > 0
    middle = points[faces[cut]].mean(axis=1)
    return [middle[plane[cut] == i, :2] for i in range(1, planes)]


@njit(cache=True, nogil=True)
def _planes_cut(layer: Floats, faces: Ints32) -> Ints32:
    """Per face the plane above the mean of its corners' layers, if they differ; else 0."""
    plane = np.zeros(len(faces), np.int32)
    for i in range(len(faces)):
        a, b, c = layer[faces[i, 0]], layer[faces[i, 1]], layer[faces[i, 2]]
        if not np.isfinite(a + b + c):
            continue
        a, b, c = np.floor(a), np.floor(b), np.floor(c)
        if a != b or b != c:
            plane[i] = int(np.floor((a + b + c) / 3.0)) + 1
    return plane


def _circle(points: Floats, rng: np.random.Generator) -> tuple[Floats, float]:
    """Centre and radius: RANSAC with samples of three, then the non-iterative fit to the points it kept."""
    best = np.zeros(len(points), dtype=np.bool_)
    for _ in range(_CIRCLE_ITERATIONS):
        centre, radius = _algebraic(points[rng.choice(len(points), 3, replace=False)])
        kept = np.abs(np.hypot(*(points - centre).T) - radius) < _CIRCLE_TOLERANCE_MM
        best = kept if kept.sum() > best.sum() else best
    return _algebraic(points[best] if best.sum() >= 3 else points)


def _algebraic(points: Floats) -> tuple[Floats, float]:
    """Least squares of x² + y² + Bx + Cy + D (Kåsa; reference 8 of the paper)."""
    origin = points.mean(axis=0)
    x, y = (points - origin).T
    design = np.stack([x, y, np.ones_like(x)], axis=1)
    b, c, d = np.linalg.lstsq(design, -(x**2 + y**2), rcond=None)[0]
    centre = np.array([-b / 2.0, -c / 2.0])
    return origin + centre, float(np.sqrt(max(centre @ centre - d, 0.0)))


def agreeing(angles: Floats, tolerance: float, iterations: int, rng: np.random.Generator) -> Bools:
    """RANSAC with samples of one: the circles that agree with the best of the tried angles."""
    best = np.zeros(len(angles), dtype=np.bool_)
    for i in rng.integers(0, len(angles), iterations):
        agree = np.abs(turn_rad(angles - angles[i])) < tolerance
        best = agree if agree.sum() > best.sum() else best
    return best


def _significance(agree: int, circles: int, chance: float, iterations: int) -> float:
    """How unlikely, in sigma, it is that so many of the others agree by chance with one of the tried."""
    tail = float(binom.sf(agree - 2, circles - 1, chance)) * iterations
    return float(max(-ndtri(min(max(tail, 1e-300), 1.0 - 1e-9)), 0.0))


def _with_angle(burr: Burr, angle: float, agreeing: Floats, axis: Axis) -> Burr:
    """The burr at the angle that the paper's mean gives, its pose turned there about the axis."""
    spread = turn_rad(agreeing - angle)
    sigma = float(np.std(spread) / np.sqrt(max(len(spread) - 1, 1)))
    part = T_part_mesh(axis.point_mm, axis.direction)
    by = angle - np.radians(burr.angle_deg.value)
    turn = np.eye(4)
    turn[:2, :2] = [[np.cos(by), -np.sin(by)], [np.sin(by), np.cos(by)]]
    return dataclasses.replace(
        burr,
        angle_deg=Value(float(np.degrees(angle)), float(np.degrees(sigma))),
        T_mesh_burr=np.linalg.inv(part) @ turn @ part @ burr.T_mesh_burr,
    )


def _angle_only(sign: int, significance: float) -> Burr:
    """A burr of which nothing but the angle is known."""
    return Burr(
        side=side_of(sign),
        angle_deg=_UNKNOWN,
        z_start_mm=_UNKNOWN,
        z_end_mm=_UNKNOWN,
        height_mm=_UNKNOWN,
        width_mm=_UNKNOWN,
        length_mm=_UNKNOWN,
        area_mm2=_UNKNOWN,
        volume_mm3=_UNKNOWN,
        T_mesh_burr=np.full((4, 4), np.nan),
        significance=significance,
    )
