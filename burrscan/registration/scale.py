"""How noisy a view is, and how far apart its points must be for its noise not to look like its shape.

A scan may have many points within the thickness of its own noise. Its triangles then fold over, the nearest
point lies anywhere in that thickness, and a plane through a few neighbours stands any way. The noise shows in
how thick the surface is, over neighbourhoods that grow until they are clearly wider than thick. What is finer
than the working scale is averaged away (:mod:`burrscan.registration.averaged`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from burrscan.arrays import Floats

_PLACES = 250
"""Where the thickness is measured: its median is then known to a tenth even where half of them are edges."""
_LEAST_NEIGHBOURS, _MOST_NEIGHBOURS = 16, 4096
"""A quadric has six unknowns; beyond the most, shape is meant and no noise."""
_FLAT = 0.15
"""Thickness over reach of a neighbourhood that is clearly a surface: 0.6 and more where it is all noise."""
_TANGENT = 6
"""Unknowns of the quadric that takes curvature off the thickness."""
_REACH_SIGMAS = 6.0
"""Least working scale in noise deviations: a plane through points so far apart leans by a sixth at most, and
cells of that size cut the surface crosswise, not along."""
_LEAN = 0.02
"""Noise of an averaged point over the scale: what a plane through neighbours then leans by, rad."""


@dataclass(frozen=True)
class Scale:
    """What the points of a view say of themselves.

    Parameters
    ----------
    noise_mm
        Standard deviation across the surface, from one point to its neighbours: noise that neighbours share
        is not in it.
    pitch_mm
        Distance that as many points evenly spread over the surface would have.

    """

    noise_mm: float
    pitch_mm: float

    @property
    def working_mm(self) -> float:
        """Distance of points from which on shape outweighs noise; at least the pitch."""
        averaged = np.sqrt(self.noise_mm * self.pitch_mm / _LEAN)
        return float(max(self.pitch_mm, _REACH_SIGMAS * self.noise_mm, averaged))


def scale_of(points_mm: Floats, tree: cKDTree, rng: np.random.Generator) -> Scale:
    """Measure a view's noise and pitch: (V, 3) points and the tree over them. O(log V) for 250 places."""
    places = points_mm[rng.permutation(len(points_mm))[:_PLACES]]
    most = min(_MOST_NEIGHBOURS, len(points_mm))
    count = min(_LEAST_NEIGHBOURS, most)
    while True:
        distance, near = (np.asarray(found) for found in tree.query(places, k=count))
        reach = float(np.median(distance[:, -1]))
        noise = float(np.median(_thickness(points_mm[near])))
        if noise < _FLAT * reach or 2 * count > most:
            return Scale(noise, reach * float(np.sqrt(np.pi / count)))
        count *= 2


def _thickness(points_mm: Floats) -> Floats:
    """(N,) RMS distance of (N, k, 3) points from the quadrics over their planes."""
    local = points_mm - points_mm.mean(axis=1, keepdims=True)
    axes = np.linalg.eigh(local.transpose(0, 2, 1) @ local)[1]
    w, u, v = np.moveaxis(local @ axes, 2, 0)
    design = np.stack([np.ones_like(u), u, v, u * u, u * v, v * v], axis=2)
    design /= np.linalg.norm(design, axis=1, keepdims=True) + np.finfo(float).tiny
    base, size, _ = np.linalg.svd(design, full_matrices=False)
    base *= (size > np.finfo(float).eps * w.shape[1] * size[:, :1])[:, None]  # points on a line know less
    rest = w - (base @ (base.transpose(0, 2, 1) @ w[..., None]))[..., 0]
    return np.asarray(np.linalg.norm(rest, axis=1) / np.sqrt(max(w.shape[1] - _TANGENT, 1)))
