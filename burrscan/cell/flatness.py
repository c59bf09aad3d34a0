"""What a look measured where another look calls a burr: bare metal there speaks against it.

A ghost, light that reached a shaded place over another surface, hangs over the part and moves with the
scanner; the metal under it is measured from elsewhere.
"""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats
from burrscan.cell.chart import beside
from burrscan.inspection import Burr

_CREST = 0.25
"""Of the burr's width on either side of its line, where it is high: flanks are measured wrongly at times."""
_LOW = 0.25
"""Share of the burr's height, under which a point lies on bare metal."""
_FLAT = 0.8
"""Share of the points under a burr that lie on bare metal where there is none; of a real one at most half
does, where a flank mirrors the part."""
_POINTS = 15
"""Fewer are the strays of an edge."""


def bare(burr: Burr, T_part_burr: Floats, points_mm: Floats, deviation_mm: Floats) -> bool:
    """Whether a look measured bare metal under a burr.

    Parameters
    ----------
    burr
        As another look called it: its side and sizes.
    T_part_burr
        (4, 4) its pose.
    points_mm, deviation_mm
        (V, 3) in the part frame and (V,) from the generatrix, of this look.

    Notes
    -----
    O(V). A line that goes around the axis is followed around.

    """
    local = beside(T_part_burr, points_mm)
    half = 0.5 * burr.length_mm.value, _CREST * burr.width_mm.value
    under = (np.abs(local[:, 0]) < half[0]) & (np.abs(local[:, 1]) < half[1]) & np.isfinite(deviation_mm)
    under &= np.abs(local[:, 2]) < burr.height_mm.value + half[1]
    if np.count_nonzero(under) < _POINTS:
        return False
    return bool(np.mean(burr.sign * deviation_mm[under] < _LOW * burr.height_mm.value) >= _FLAT)
