"""The generatrix as radius over position along the axis: the plain reading of the seed paper, section 5.2."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats, Ints32
from burrscan.errors import InputError
from burrscan.generatrix.profile import profile_of
from burrscan.inspection import Axis, Generatrix
from burrscan.robust import MEDIAN_OVER_MEAN, SIGMA_PER_MEDIAN

_LEAST = 8
"""Vertices of a step along the axis: the median of fewer is no summary, and their span says little."""


def fit_radius(
    vertices_mm: Floats,
    faces: Ints32,  # noqa: ARG001 (every method takes them)
    axis: Axis,
    *,
    sigma_mm: Floats | float | None = None,  # noqa: ARG001 (every method takes it)
    bins: int = 100,
) -> Generatrix:
    """Median radius in equal steps along the axis.

    It knows neither flat faces nor undercuts nor bores, and is kept to compare with.

    Raises
    ------
    InputError
        When no step holds enough vertices.

    Notes
    -----
    O(V log V).

    """
    profile = profile_of(vertices_mm, axis)
    known = np.isfinite(profile.z_mm)
    z, r = profile.z_mm[known], profile.r_mm[known]
    edges = np.linspace(z.min(), z.max(), bins + 1)
    order = np.argsort(z, kind="stable")
    parts = np.split(r[order], np.searchsorted(z[order], edges[1:-1]))
    rows = [
        (middle, *_summary(part)) if len(part) >= _LEAST else (np.nan,) * 4
        for middle, part in zip((edges[:-1] + edges[1:]) / 2.0, parts, strict=True)
    ]
    columns = np.array(rows).T
    if np.isfinite(columns[0]).sum() < 2:
        raise InputError(f"no generatrix: none of {bins} steps along the axis holds {_LEAST} vertices")
    return Generatrix(*columns)


def _summary(radii: Floats) -> tuple[float, float, float]:
    """Median, its standard deviation (1.25 sigma / root n), and the whole span."""
    middle = float(np.median(radii))
    sigma = SIGMA_PER_MEDIAN * float(np.median(np.abs(radii - middle)))
    return middle, MEDIAN_OVER_MEAN * sigma / np.sqrt(len(radii)), float(np.ptp(radii))
