"""RANSAC over line complexes, with the sign-free distance of Cao and Mumford as its cost.

J. H. Hong et al., "PotSAC: a robust axis estimator for axially symmetric pot fragments", ICCV workshops 2019
(cited from memory: the paper was not at hand); Y. Cao, D. Mumford, "Geometric structure estimation of axially
symmetric pots from small fragments", 2002.
"""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats, Ints32
from burrscan.axis.fitting.starts import WIDTH, descend
from burrscan.axis.points.surfels import Surfels
from burrscan.axis.rivals.common import bare_axis, patches
from burrscan.axis.rivals.line_complex import fit_complex
from burrscan.inspection import Axis

SAMPLE = 6
"""Normals a sample: a line complex has six coefficients up to a factor; Hong et al. (2019) draw six."""


def find_axis_potsac(
    vertices_mm: Floats,
    faces: Ints32 | None,  # noqa: ARG001
    *,
    sigma_mm: Floats | None = None,
    seed: int = 0,
    rounds: int = 300,
    truncation: float = 0.05,
) -> Axis:
    """Sample six normals at a time, keep the least truncated cost, refine robustly.

    Parameters
    ----------
    rounds
        Samples.
    truncation
        Distance, in units of the rms radius, beyond which a patch costs no more.

    """
    cloud, surfels = patches(vertices_mm, sigma_mm)
    rng = np.random.default_rng(seed)
    best = (np.inf, np.array([0.0, 0.0, 1.0]), np.zeros(3))
    for _ in range(rounds):
        pick = rng.choice(len(surfels.weights), size=min(SAMPLE, len(surfels.weights)), replace=False)
        few = Surfels(surfels.points[pick], surfels.normals[pick], surfels.weights[pick])
        direction, place = fit_complex(few, np.ones(len(pick)))
        cost = truncated_cost(surfels, direction, place, truncation)
        if cost < best[0]:
            best = (cost, direction, place)
    direction, place, _ = descend(
        surfels.points, surfels.normals, surfels.weights, best[1], best[2], WIDTH, 30
    )
    return bare_axis(cloud, direction, place, "potsac", rounds)


def truncated_cost(surfels: Surfels, direction: Floats, place: Floats, truncation: float) -> float:
    """Mean of min(|T2 - s T3|, |T2 + s T3|)², truncated; T2 = (p - c) × a, T3 = n × a, s = |T2| / |T3|."""
    T2 = np.cross(surfels.points - place, direction)
    T3 = np.cross(surfels.normals, direction)
    length = np.linalg.norm(T3, axis=1)
    scaled = T3 * (np.linalg.norm(T2, axis=1) / np.maximum(length, 1e-3))[:, None]
    square = np.minimum(((T2 - scaled) ** 2).sum(axis=1), ((T2 + scaled) ** 2).sum(axis=1))
    square[length < 1e-3] = 0.0  # a flat face across the axis says nothing of its place
    return float(surfels.weights @ np.minimum(square, truncation**2))
