"""Where a burr that is known to be there is in one look: the matched filter, not the detector.

A detector must decide; a servo knows what it looks for and wants the place. So the deviations around the
expected place are averaged along the burr, and the place across it is the centroid of what stands out where
a burr of this width stands out most.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from burrscan.arrays import Bools, Floats
from burrscan.axis.basis import T_part_mesh
from burrscan.generatrix.deviation import feet_of
from burrscan.generatrix.polyline import polyline_of
from burrscan.inspection import Burr, Value
from burrscan.pipeline import Outcome
from burrscan.pose import placed

_STEP_MM = 0.1
"""Of the profile across the burr."""
_BLUR_MM = 0.3
"""Standard deviation over which it is averaged: the distance of pixels, so that each has its say."""
_BESIDE_MM = 0.5
"""Of the burr's base that its centroid takes in."""
_SETTLED = 8
"""Rounds of the centroid; five do."""
_STANDS_OUT = 5.0
"""Standard deviations of its mean by which the profile must stand out."""
_HIGH = 0.15
"""Share of the burr's height that it must reach: dark flanks lower the mean."""
_LEAST = 12
"""Points near the place."""


def tracked(outcome: Outcome, burr: Burr, T_camera_burr: Floats, *, gate_mm: float) -> Burr | None:
    """The burr with its pose in this look's camera frame; None where nothing stands out near its place.

    Parameters
    ----------
    outcome
        Of the look.
    burr
        As it was found: its side, width, length and height.
    T_camera_burr
        (4, 4) where it is expected.
    gate_mm
        How far across and along it may be from there.

    Notes
    -----
    O(vertices). The pose lies on the fitted surface, its x in the sense of the one expected.

    """
    surface, inspection = outcome.surface, outcome.inspection
    local = placed(np.linalg.inv(T_camera_burr), surface.vertices_mm)
    sign = 1.0 if burr.side == "protrusion" else -1.0
    deviation = sign * inspection.deviation_mm
    width, half = burr.width_mm.value, 0.5 * burr.length_mm.value
    high = burr.height_mm.value
    near = np.isfinite(deviation) & (np.abs(local[:, 2]) < gate_mm + 2.0 * high)
    near &= np.abs(local[:, 0]) < half
    near &= np.abs(local[:, 1]) < 2.0 * gate_mm + width
    if near.sum() < _LEAST:
        return None
    sigma = float(np.median(surface.vertex_sigma_mm[near]))
    across = _centre(local[near, 1], deviation[near], sigma, width=width, gate_mm=gate_mm, high=high)
    if across is None:
        return None
    on_crest = np.isfinite(deviation) & (np.abs(local[:, 1] - across) < 0.5 * width)
    on_crest &= (np.abs(local[:, 0]) < half + gate_mm) & (np.abs(local[:, 2]) < gate_mm + 2.0 * high)
    along, length = _extent(local[on_crest, 0], deviation[on_crest], half)
    pose = _on_surface(outcome, T_camera_burr @ _shift(along, across))
    return replace(burr, T_mesh_burr=pose, length_mm=Value(length, burr.length_mm.sigma))


def _centre(
    y: Floats, deviation: Floats, sigma: float, *, width: float, gate_mm: float, high: float
) -> float | None:
    """The place across the burr."""
    grid = np.arange(-gate_mm - width, gate_mm + width + _STEP_MM, _STEP_MM)
    kernel = np.exp(-0.5 * ((grid[:, None] - y[None]) / _BLUR_MM) ** 2)
    weight = kernel.sum(axis=1)
    known: Bools = weight > 1.0
    if known.sum() < 2:
        return None
    profile = np.interp(grid, grid[known], (kernel @ deviation)[known] / weight[known])
    above = np.clip(profile - float(np.median(profile)), 0.0, None)
    under = np.array([above[np.abs(grid - place) <= 0.5 * width].sum() for place in grid])
    place = float(grid[np.argmax(np.where(np.abs(grid) <= gate_mm, under, -1.0))])
    for _ in range(_SETTLED):
        here = np.abs(grid - place) <= 0.5 * width + _BESIDE_MM
        if not above[here].sum() > 0.0:
            return None
        place = float((above[here] * grid[here]).sum() / above[here].sum())
    here = np.abs(grid - place) <= 0.5 * width
    noise = sigma / np.sqrt(float(weight[here].max()))
    peak = float(above[here].max())
    return place if peak > max(_STANDS_OUT * noise, _HIGH * high) else None


def _extent(x: Floats, deviation: Floats, half: float) -> tuple[float, float]:
    """Middle and length of the stretch that stands out; as expected where that cannot be told."""
    if len(x) < _LEAST:
        return 0.0, 2.0 * half
    level = (
        0.5 * float(np.median(deviation[np.abs(x) < 0.5 * half])) if (np.abs(x) < 0.5 * half).any() else 0.0
    )
    out = np.sort(x[deviation > max(level, 0.0)])
    if len(out) < _LEAST or level <= 0.0:
        return 0.0, 2.0 * half
    start, end = np.quantile(out, [0.02, 0.98])
    return float(0.5 * (start + end)), float(end - start)


def _shift(along: float, across: float) -> Floats:
    step = np.eye(4)
    step[:2, 3] = along, across
    return step


def _on_surface(outcome: Outcome, T_camera_burr: Floats) -> Floats:
    """The pose put down on the fitted surface: origin on it, z along its normal."""
    axis, generatrix = outcome.inspection.axis, outcome.inspection.generatrix
    frame = T_part_mesh(axis.point_mm, axis.direction)
    pose = frame @ T_camera_burr
    x, y, z = pose[:3, 3]
    angle = float(np.arctan2(y, x))
    line = polyline_of(generatrix)
    foot = feet_of(np.array([z]), np.array([np.hypot(x, y)]), line)
    if not foot.valid[0]:
        return T_camera_burr
    segment = foot.segment[0]
    at = line.nodes_mm[line.starts[segment]] + foot.t[0] * line.steps_mm[segment]
    radial = np.array([np.cos(angle), np.sin(angle), 0.0])
    # the normal over a burr's surroundings, not of one short segment
    beside = np.hypot(*(line.nodes_mm[line.starts] - at).T) < 2.0
    mean = line.normals[beside].mean(axis=0) if beside.any() else line.normals[segment]
    normal = (mean[1] * radial + mean[0] * np.array([0.0, 0.0, 1.0])) / np.linalg.norm(mean)
    along = pose[:3, 0] - (pose[:3, 0] @ normal) * normal
    along /= np.linalg.norm(along)
    on_curve = np.eye(4)
    on_curve[:3, :3] = np.stack([along, np.cross(normal, along), normal], axis=1)
    on_curve[:3, 3] = at[1] * radial + [0.0, 0.0, at[0]]
    return np.asarray(np.linalg.inv(frame) @ on_curve)
