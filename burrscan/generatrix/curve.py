"""The generatrix as a curve in the (z, r) plane: flat faces, steps, undercuts, cylinders and bores alike."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.ndimage import binary_dilation

from burrscan.arrays import Floats, Ints32
from burrscan.axis.basis import T_part_mesh
from burrscan.errors import InputError
from burrscan.generatrix.covariance import band_mm
from burrscan.generatrix.covariance import sigma_mm as curve_sigma_mm
from burrscan.generatrix.exact import exact, feet_near, reach_from
from burrscan.generatrix.polyline import Foot, Polyline, candidates, feet, join
from burrscan.generatrix.profile import Profile, along_long_edges, profile_of
from burrscan.generatrix.refine import smooth_tangents, step
from burrscan.generatrix.tracing.cells import Cells, Looks, Scale, cells_of, scale_of, trusted, without
from burrscan.generatrix.tracing.ends import extended, trimmed
from burrscan.generatrix.tracing.meets import met
from burrscan.generatrix.tracing.outside import looks_of, oriented
from burrscan.generatrix.tracing.trace import REACH, trace
from burrscan.inspection import Axis, Generatrix

_MEDIAN_STEPS = 5
"""Steps on the small cells from a chain of cells to near the median; the last is not smoothed."""
_SUBCELLS = 4
"""Small cells per cell, which stand for the data in the first steps."""
_MOST_DATA = 0.75
"""Share of the vertices that chains of their cells hold, unless the mesh is a drawing with long edges."""
_STRAY = 0.5
"""How far off the chains what covers little of the arc is no tail of their noise, in cells: three sigma and
more."""
_OUTVOTES, _AROUND = 0.5, 7
"""Data off the chains over those along them, in a cell and its neighbours, from which robust weights, which
fail at one, are not relied on; and the cells around in which all of that is left out, as a burr spans."""


def fit_generatrix(
    vertices_mm: Floats, faces: Ints32, axis: Axis, *, sigma_mm: Floats | float | None = None
) -> Generatrix:
    """Fit the curve that, turned about ``axis``, makes the part.

    The (z, r) half-plane is cut into cells; those that hold data over a good share of the arc are walked
    along into ordered pieces, whose nodes then move along their normals to the robust least-squares curve.
    Creases are put where the two sides meet, and more nodes where the curve bends.

    Parameters
    ----------
    vertices_mm, faces
        (V, 3) and (T, 3) mesh; a cloud of vertices has no faces. NaN vertices are ignored.
    axis
        The axis of revolution.
    sigma_mm
        Stated standard deviation of the vertices, if any: a lower bound for what the data themselves show.

    Returns
    -------
    Generatrix
        Its pieces run so that the material lies to the right of their direction in the (z, r) plane, as the
        winding of the faces tells; for clouds, so that most of it looks away from the axis.

    Raises
    ------
    InputError
        When the data do not gather along any curve about this axis.

    Notes
    -----
    O(V + T). The band thickness is the test of the seed paper, section 5.2.

    """
    profile = profile_of(vertices_mm, axis)
    scale = scale_of(profile)
    side = scale.cell_mm
    transform = T_part_mesh(axis.point_mm, axis.direction)
    looks = looks_of(vertices_mm, faces, transform) if len(faces) else None
    data, fitted, _, pieces = _traced(profile, faces, scale, looks)
    if not pieces:
        raise InputError(
            "no generatrix: the data do not gather along a curve about this axis; is the part a surface of "
            "revolution, and was its axis found?"
        )
    rough = _rough(pieces, cells_of(fitted, scale, side_mm=side / _SUBCELLS), side, scale.node_mm)
    rough = met(rough, spacing_mm=scale.node_mm, reach_mm=REACH * side)
    turned = oriented(rough, vertices_mm, faces, transform, side_mm=side)
    stated = _stated(sigma_mm)
    fit, foot = exact(join(turned), fitted, scale, stated_mm=stated)
    sigma = curve_sigma_mm(fit, foot, fitted.angle, scale.arc, stated)
    all_feet = foot if fitted is data else feet_near(data, fit.line, scale)[0]
    return _described(fit.line, sigma, band_mm(fit.line, all_feet))


class _Traced(NamedTuple):
    """Data, those of them that may be the curve's, the cells of all, and chains of those that go round."""

    data: Profile
    fitted: Profile
    cells: Cells
    pieces: list[Floats]


def _traced(profile: Profile, faces: Ints32, scale: Scale, looks: Looks | None) -> _Traced:
    """What the curve is fitted to: the vertices, or where they are few the edges too."""
    found = _chained(profile, scale, looks)
    if not len(faces) or _share(found.pieces, found.cells, scale.cell_mm) > _MOST_DATA:
        return found
    return _chained(along_long_edges(profile, faces, step_mm=1.5 * scale.cell_mm), scale, looks)


def _chained(data: Profile, scale: Scale, looks: Looks | None) -> _Traced:
    """What stands off the chains over little of the arc is not fitted where it would outvote them.

    So does a burr on the rim of a cylinder that is looked at from its end. Past a chain nobody knows.
    """
    side = scale.cell_mm
    cells = cells_of(data, scale, side_mm=side, looks=looks)
    pieces = trace(trusted(cells, scale, side_mm=side), side_mm=side)
    if not pieces:
        return _Traced(data, data, cells, pieces)
    chains = join(pieces)
    foot = _feet(chains, cells, side, reach_mm=reach_from(chains, scale), overshoot_mm=0.0)
    stray = cells.rare & foot.valid & (np.abs(foot.distance_mm) > _STRAY * side)
    off, along = (
        np.convolve(np.bincount(foot.segment[one], cells.count[one], len(chains.starts)), np.ones(3), "same")
        for one in (stray, foot.valid & ~stray)
    )
    outvoted = binary_dilation(off > _OUTVOTES * along, np.ones(_AROUND, bool))
    stray[stray] = outvoted[foot.segment[stray]]
    fitted = without(data, cells, stray, scale, side_mm=side) if stray.any() else data
    return _Traced(data, fitted, cells, pieces)


def _share(pieces: list[Floats], cells: Cells, side: float) -> float:
    """Share of the data that lies along the pieces."""
    if not pieces:
        return 0.0
    near = _cell_feet(join(pieces), cells, side).valid
    return float(cells.count[near].sum() / cells.count.sum())


def _stated(sigma_mm: Floats | float | None) -> float:
    return 0.0 if sigma_mm is None else float(np.nanmedian(sigma_mm))


def _rough(pieces: list[Floats], cells: Cells, side: float, spacing: float) -> list[Floats]:
    """From chains of cells to curves near the data: evenly spaced nodes, ends trimmed.

    Small cells stand for the data in them.
    """
    line = join([extended(resampled(piece, step_mm=spacing), by_mm=side) for piece in pieces])
    start = np.full(len(line.nodes_mm), side / _SUBCELLS)
    for i in range(_MEDIAN_STEPS):
        if i < _MEDIAN_STEPS - 1:
            line = smoothed(line)
        foot = _cell_feet(line, cells, side)
        tangents = smooth_tangents(line)
        line = step(line, foot, scale_mm=start, tangents=tangents, count=cells.count).line
    kept = trimmed(line, _cell_feet(line, cells, side), cells.seen)
    return [piece for piece in kept if len(piece) > 2]


def _cell_feet(line: Polyline, cells: Cells, side: float) -> Foot:
    return _feet(line, cells, side, reach_mm=1.5 * side, overshoot_mm=0.5 * side)


def _feet(line: Polyline, cells: Cells, side: float, *, reach_mm: float, overshoot_mm: float) -> Foot:
    z, r = np.ascontiguousarray(cells.centre_mm.T)
    near = candidates(z, r, line, side_mm=0.5 * side, slack_mm=0.0, reach_mm=reach_mm)
    return feet(z, r, line, near, overshoot_mm=overshoot_mm)


def _described(line: Polyline, sigma: Floats, band: Floats) -> Generatrix:
    """The public type, NaN between pieces."""
    gaps = np.flatnonzero(np.diff(line.starts) > 1)
    at = line.starts[gaps] + 2
    columns = [line.nodes_mm[:, 0], line.nodes_mm[:, 1], sigma, band]
    return Generatrix(*(np.insert(column, at, np.nan) for column in columns))


def resampled(points: Floats, *, step_mm: float) -> Floats:
    """A (K, 2) polyline smoothed once (1 2 1) and cut into steps of about ``step_mm``. O(K)."""
    smooth = points.copy()
    smooth[1:-1] = 0.25 * points[:-2] + 0.5 * points[1:-1] + 0.25 * points[2:]
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(smooth, axis=0), axis=1))])
    wanted = np.linspace(0.0, along[-1], max(round(float(along[-1]) / step_mm), 2) + 1)
    return np.stack([np.interp(wanted, along, smooth[:, i]) for i in range(2)], axis=1)


def smoothed(line: Polyline) -> Polyline:
    """Every node drawn half-way to the middle of its neighbours, ends of pieces kept. O(K)."""
    inner = line.starts[1:][np.diff(line.starts) == 1]
    nodes = line.nodes_mm.copy()
    nodes[inner] = 0.25 * line.nodes_mm[inner - 1] + 0.5 * nodes[inner] + 0.25 * line.nodes_mm[inner + 1]
    return Polyline(nodes, line.starts)
