"""Vertices at the border of a mesh: half of what such a pixel sees is hidden or in shadow."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Bools, Floats, Ints32

_MOST = 0.35
"""A mesh with a larger share of border than this is full of pinholes: its border is nothing special."""


def inner(faces: Ints32, count: int) -> Bools:
    """(count,) True for the vertices that do not lie on the border of their mesh, nor off it.

    The footprint of a pixel at a terminator, a limb or a step in depth is seen or lit in part only, and its
    centroid is off its centre. So vertices on a border err together, all the way along it, by more than
    their noise: see :func:`border_spread_mm`. For clouds and meshes full of pinholes all are inner. O(T).
    """
    if not len(faces):
        return np.ones(count, dtype=np.bool_)
    # In a fan that closes each neighbour is next once and previous once; in one with a gap two are left over.
    balance = np.zeros(count)
    for corner in range(3):
        before, after = (faces[:, (corner + step) % 3].astype(np.float64) for step in (2, 1))
        balance += np.bincount(faces[:, corner], after - before, count)
    inside: Bools = (balance == 0.0) & (np.bincount(faces.ravel(), minlength=count) > 0)
    return inside if inside.mean() > 1.0 - _MOST else np.ones(count, dtype=np.bool_)


def deep(faces: Ints32, inside: Bools) -> Bools:
    """(count,) True for the vertices that are :func:`inner`, as are all that a face joins them to. O(T)."""
    outer = ~inside[faces].all(axis=1)
    ring: Bools = np.bincount(faces[outer].ravel(), minlength=len(inside)) > 0
    return inside & ~ring


def border_spread_mm(deviation_mm: Floats) -> float:
    """Noise of vertices on borders, a class of its own: 98 of 100 are off by no more than 1.645 times this.

    Of normal noise it would be 90; borders have heavier tails. They count with that noise: a burr so steep
    that it is an island of the mesh is all border.
    """
    return float(np.quantile(np.abs(deviation_mm), 0.98)) / 1.645 if len(deviation_mm) else 0.0
