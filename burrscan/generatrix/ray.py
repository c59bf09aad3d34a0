"""Where rays meet a surface of revolution."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats, Ints
from burrscan.generatrix.polyline import Polyline

_ROUNDING = 1e-9
"""Share of a place's distance from the origin within which two ways to say where it is agree: arithmetic."""
_MOST_PAIRS = 1 << 20
"""Rays times segments at once: some twenty arrays of eight megabytes."""


def first_met(
    line: Polyline, origin_mm: Floats, direction: Floats, *, beyond_mm: float
) -> tuple[Floats, Ints]:
    """Where rays first meet the surface that a polyline makes, part frame.

    Each segment turned about the axis is a frustum of a cone, with cylinders and discs among them: one
    quadratic for each ray and segment, of whose roots those count that lie on the segment.

    Parameters
    ----------
    line
        The generatrix.
    origin_mm, direction
        (N, 3) start and direction of each ray; of any length, which distances are counted in.
    beyond_mm
        Distance up to which nothing is met, so that a ray leaves the surface that it starts on.

    Returns
    -------
    distance
        (N,) how far, infinite where nothing is met.
    segment
        (N,) number of the segment that is met, -1 where none is.

    Notes
    -----
    O(N · segments) time, in blocks of rays that bound the memory.

    """
    blocks = -(-len(direction) * len(line.starts) // _MOST_PAIRS) or 1
    rays = zip(np.array_split(origin_mm, blocks), np.array_split(direction, blocks), strict=True)
    found = [_first_met(line, *block, beyond_mm) for block in rays]
    distance, segment = (np.concatenate(each) for each in zip(*found, strict=True))
    return distance, segment


def _first_met(line: Polyline, origin_mm: Floats, direction: Floats, beyond_mm: float) -> tuple[Floats, Ints]:
    """:func:`first_met` of one block of rays."""
    z, r = line.nodes_mm[line.starts].T
    dz, dr = line.steps_mm.T
    (x, y, h), (u, v, w) = origin_mm.T[:, :, None], direction.T[:, :, None]
    at = r * dz + (h - z) * dr  # the cone's radius times dz, where the ray starts; and how it grows
    grows = w * dr
    a = (u * u + v * v) * dz**2 - grows**2
    b = (x * u + y * v) * dz**2 - at * grows
    c = (x * x + y * y) * dz**2 - at**2
    square = b * b - a * c
    touches = square > -_ROUNDING * b * b  # a disc's roots are one root twice
    root = np.sqrt(np.where(touches, np.maximum(square, 0.0), np.nan))
    with np.errstate(divide="ignore", invalid="ignore"):
        each = np.stack([(-b - root) / a, (-b + root) / a])
        radius = np.hypot(x + each * u, y + each * v)
        height = h + each * w
        along = ((height - z) * dz + (radius - r) * dr) / (dz**2 + dr**2)
        off = np.hypot(height - z - along * dz, radius - r - along * dr)
        on = (along >= 0.0) & (along <= 1.0) & (off <= 1e3 * _ROUNDING * (1.0 + radius))
        each = np.where(on & (each > beyond_mm), each, np.inf).min(axis=0)
    nearest = np.argmin(each, axis=1)
    distance = np.take_along_axis(each, nearest[:, None], axis=1)[:, 0]
    return distance, np.where(np.isfinite(distance), nearest, -1)
