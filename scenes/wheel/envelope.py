"""The outermost surface of a wheel as a function of z, and the curves at a given distance from it."""

from __future__ import annotations

import numpy as np
from numba import njit

from burrscan.arrays import Bools, Floats
from scenes.wheel.outline import Outline

_FACING = 0.25
"""Least radial part of the normal of a surface that a burr parallel to the axis can follow: 75.5 degrees."""
_WINDOW = 4.0
"""A surface farther off in radius than this many heights is another step: on a slope of 75.5 degrees the foot
of a normal of length h lies 3.75 h away in radius."""


def outer_radius(outline: Outline, z_mm: Floats) -> Floats:
    """(N,) largest radius at each z; NaN beyond the wheel's ends. O(N S)."""
    return np.asarray(_outermost(outline.start_zr, outline.end_zr, np.asarray(z_mm, np.float64)))


@njit(cache=True, nogil=True)
def _outermost(start_zr: Floats, end_zr: Floats, z_mm: Floats) -> Floats:
    """A table of every position and segment would take longer than all else of a burr's shape."""
    largest = np.full(len(z_mm), np.nan)
    for i in range(len(z_mm)):
        for s in range(len(start_zr)):
            a, b = start_zr[s, 0], end_zr[s, 0]
            if not min(a, b) <= z_mm[i] <= max(a, b):
                continue
            if a == b:  # a face square to the axis counts with its outer rim
                r = max(start_zr[s, 1], end_zr[s, 1])
            else:
                share = min(max((z_mm[i] - a) / (b - a), 0.0), 1.0)
                r = start_zr[s, 1] + share * (end_zr[s, 1] - start_zr[s, 1])
            if not r <= largest[i]:
                largest[i] = r
    return largest


def offset_radius(outline: Outline, z_mm: Floats, distance_mm: Floats) -> Floats:
    """(N,) radius, at each z, of the curve at a distance from the outermost surface, positive outside.

    The grey-scale dilation (erosion) of the surface by a disc: each of its points is exactly that far from
    the surface on cylinders, cones and fillets, and never farther. The outline being piecewise straight, the
    extreme of the discs about its points and of its shifted segments is exact. Faces steeper than 75 degrees
    and steps higher than four times the distance do not count: a burr does not climb them. O(N S).

    Parameters
    ----------
    outline
        S segments.
    z_mm
        (N,) positions inside the wheel.
    distance_mm
        (N,) all of one sign.

    """
    sign = 1.0 if distance_mm[0] > 0.0 else -1.0
    level = outer_radius(outline, z_mm)
    facing = _facing(outline)
    shifted = _shifted(outline, facing, z_mm, distance_mm, level)
    about = _about(
        np.concatenate([outline.start_zr[facing], outline.end_zr[facing]]), z_mm, distance_mm, level
    )
    radius = sign * np.max(sign * np.concatenate([shifted, about], axis=1), axis=1, initial=-np.inf)
    # where nothing counts, on a rounded edge steeper than 75 degrees, the distance is taken along the radius
    return np.asarray(np.where(np.isfinite(radius), radius, level + distance_mm))


def _facing(outline: Outline) -> Bools:
    """(S,) segments of the outermost surface that face outwards."""
    along = outline.end_zr - outline.start_zr
    middle = (outline.start_zr + outline.end_zr) / 2.0
    outermost = middle[:, 1] >= outer_radius(outline, middle[:, 0]) - 1e-6
    return np.asarray(outermost & (along[:, 0] > _FACING * np.linalg.norm(along, axis=1)))


def _about(points: Floats, z_mm: Floats, distance_mm: Floats, level: Floats) -> Floats:
    """(N, P) extreme radius of the disc about each point; infinitely bad where it does not count."""
    reach = distance_mm[:, None] ** 2 - (z_mm[:, None] - points[:, 0]) ** 2
    sign = np.sign(distance_mm)[:, None]
    counts = (reach >= 0.0) & _same_step(points[:, 1], distance_mm, level)
    radius = points[:, 1] + sign * np.sqrt(np.maximum(reach, 0.0))
    return np.asarray(np.where(counts, radius, -sign * np.inf))


def _shifted(outline: Outline, facing: Bools, z_mm: Floats, distance_mm: Floats, level: Floats) -> Floats:
    """(N, F) radius on each facing segment shifted along its normal; infinitely bad where it ends."""
    a, along = outline.start_zr[facing], (outline.end_zr - outline.start_zr)[facing]
    normal = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.linalg.norm(along, axis=1, keepdims=True)
    shift = distance_mm[:, None]
    share = (z_mm[:, None] - shift * normal[:, 0] - a[:, 0]) / along[:, 0]
    foot = a[:, 1] + share * along[:, 1]
    counts = (share >= 0.0) & (share <= 1.0) & _same_step(foot, distance_mm, level)
    return np.asarray(np.where(counts, foot + shift * normal[:, 1], -np.sign(shift) * np.inf))


def _same_step(radius: Floats, distance_mm: Floats, level: Floats) -> Bools:
    return np.asarray(np.abs(radius - level[:, None]) <= _WINDOW * np.abs(distance_mm)[:, None])
