"""How far each vertex is from the ideal surface."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Bools, Floats
from burrscan.generatrix.polyline import Foot, Polyline, at_open_end, candidates, feet, polyline_of
from burrscan.generatrix.profile import profile_of
from burrscan.inspection import Axis, Generatrix

REACH = 0.1
"""Share of the largest radius up to which deviations are told."""


def deviation_mm(vertices_mm: Floats, axis: Axis, generatrix: Generatrix) -> Floats:
    """Signed distance of each vertex from the surface of revolution, outwards positive.

    Parameters
    ----------
    vertices_mm
        (V, 3) in the frame of ``axis``.
    axis, generatrix
        The ideal surface; the generatrix has its material on the right of its direction.

    Returns
    -------
    Floats
        (V,) distance along the normal of the nearest place on the curve; NaN for NaN vertices, beyond an open
        end of the curve, and further from it than a tenth of its largest radius.

    Notes
    -----
    O(V): a grid in the (z, r) plane knows which segments can be nearest.

    """
    profile = profile_of(vertices_mm, axis)
    return feet_of(profile.z_mm, profile.r_mm, polyline_of(generatrix)).distance_mm


def feet_of(z_mm: Floats, r_mm: Floats, line: Polyline) -> Foot:
    """The nearest places on a finished generatrix. O(V)."""
    return _feet_within(_reach_mm(line), z_mm, r_mm, line, overshoot_mm=_side_mm(line))


def further_than(limit_mm: float, z_mm: Floats, r_mm: Floats, line: Polyline, foot: Foot) -> Bools:
    """(V,) True for what is further from the curve; NaN is not. ``foot`` is of :func:`feet_of`. O(V)."""
    asked = np.flatnonzero(np.isfinite(z_mm + r_mm) & ~(np.abs(foot.distance_mm) <= limit_mm))
    near = _feet_within(limit_mm, z_mm[asked], r_mm[asked], line, overshoot_mm=np.inf)
    further = np.zeros(len(z_mm), dtype=np.bool_)
    further[asked] = ~(np.abs(near.distance_mm) <= limit_mm)
    return further


def past_ends(z_mm: Floats, r_mm: Floats, line: Polyline, foot: Foot) -> Bools:
    """(V,) True where the nearest place on the curve is an open end of it; what is out of reach is not.

    ``foot`` is of :func:`feet_of`. O(V).
    """
    past = at_open_end(line, foot)
    asked = np.flatnonzero(np.isfinite(z_mm + r_mm) & ~foot.valid)
    past[asked] = _feet_within(_reach_mm(line), z_mm[asked], r_mm[asked], line, overshoot_mm=np.inf).valid
    return past


def _reach_mm(line: Polyline) -> float:
    return max(4.0 * _side_mm(line), REACH * float(line.nodes_mm[:, 1].max()))


def _feet_within(reach_mm: float, z_mm: Floats, r_mm: Floats, line: Polyline, *, overshoot_mm: float) -> Foot:
    near = candidates(z_mm, r_mm, line, side_mm=0.5 * _side_mm(line), slack_mm=0.0, reach_mm=reach_mm)
    return feet(z_mm, r_mm, line, near, overshoot_mm=overshoot_mm)


def _side_mm(line: Polyline) -> float:
    return float(np.median(line.lengths_mm))
