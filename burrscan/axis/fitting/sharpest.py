"""Where along its own plane an axis of known direction makes the generatrix sharpest.

Turned about the right axis, what lies on common parallels falls on common places of the (z, r) plane, tops of
lugs on tops and bottoms on bottoms, whichever of them a view shows where. The integral of the squared density
there, the information potential (Principe 2010), has a wide basin at a coarse blur and a sharp one at a fine.
"""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats
from burrscan.axis.fitting.ridges import density_field, meridian_bounds
from burrscan.axis.points.cloud import REACH

BLURS = (0.05, 0.02)
"""One after the other, in rms radii: those that the starts of a fit are refined at."""
FIRST = 0.2
"""First step of the search: what a start may be off where one face says nearly all, in rms radii."""
LAST = 0.2
"""Least step, in blurs: the fit that follows does the rest."""
AROUND = 8
"""Directions that are tried."""


def sharpest_place(points: Floats, weights: Floats, frame: Floats, place: Floats) -> Floats:
    """(3,) place of the axis with the greatest information potential near ``place``.

    A compass search, first at a coarse resolution. O(V + cells) a trial, some 150 of them.

    Parameters
    ----------
    points, weights
        (V, 3) in the canonical frame and (V,), or none; ten thousand will do.
    frame, place
        Of the axis to start from: columns e1, e2, direction; and a point on it.

    """
    turn = 2.0 * np.pi * np.arange(AROUND) / AROUND
    compass = np.cos(turn)[:, None] * frame[:, 0] + np.sin(turn)[:, None] * frame[:, 1]
    step = FIRST
    for blur in BLURS:
        best = _potential(points, weights, frame, place, blur)
        while step > LAST * blur:
            values = [_potential(points, weights, frame, place + step * way, blur) for way in compass]
            if max(values) > best:
                best, place = max(values), place + step * compass[int(np.argmax(values))]
            else:
                step *= 0.5
        step = 2.0 * blur
    return place


def _potential(points: Floats, weights: Floats, frame: Floats, place: Floats, blur: float) -> float:
    """Integral of the squared density over the (z, r) plane, up to a factor."""
    bounds = meridian_bounds(points, frame, place, REACH)
    field, _, cell = density_field(points, weights, frame, place, blur, bounds)
    return float((field[:, :, 0] ** 2).sum()) / cell**2
