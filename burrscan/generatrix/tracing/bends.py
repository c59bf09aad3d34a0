"""Where the curve bends more sharply than its nodes are apart: segments that the data bow away from.

Nodes one cell apart cut the corner of a rounding of one or two cells' radius, by a third of a millimetre on
a wheel of 100 mm whose faces are known to a micrometre. A segment is halved where, all around the part, the
data lie to one side in its middle and to the other at both ends.
"""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats
from burrscan.generatrix.polyline import Foot, Polyline, join
from burrscan.generatrix.tracing.cells import ARC_BINS, arc_bin
from burrscan.robust import MEDIAN_OVER_MEAN, SIGMA_PER_MEDIAN

_PARTS = (0.25, 0.75)
"""A segment's middle half, and the quarters before and after it."""
_LEAST_BINS = 6
"""Of the arc, with data in a part of a segment: fewer show no scatter."""
_CERTAIN = 4.0
"""Standard errors: one in a thousand for Student's t of ten degrees of freedom, and a curve has some
hundred segments."""


def halved(line: Polyline, foot: Foot, angle: Floats, arc: tuple[float, float], least_mm: float) -> Polyline:
    """The line with a node among the data in the middle of each segment that they bow away from. O(V + K).

    A burr is no bend: the median over the bins of the arc does not see what is on less than half of it.

    Parameters
    ----------
    line, foot
        The fitted curve and the points' nearest places on it.
    angle
        (V,) the points' angles, radians.
    arc
        (start, extent) of the angles with data.
    least_mm
        No segment gets shorter.

    """
    found = foot.valid
    part = np.digitize(foot.t[found], _PARTS)
    shape = (len(line.starts), len(_PARTS) + 1, ARC_BINS)
    flat = np.ravel_multi_index((foot.segment[found], part, arc_bin(angle[found], arc)), shape)
    size = int(np.prod(shape))
    count = np.bincount(flat, minlength=size).reshape(shape)
    total = np.bincount(flat, foot.distance_mm[found], size).reshape(shape)
    with np.errstate(invalid="ignore"):
        off, error = _off(total / count)
    bow = off[:, 1] - 0.5 * (off[:, 0] + off[:, 2])
    bow_sigma = np.sqrt(error[:, 1] ** 2 + 0.25 * (error[:, 0] ** 2 + error[:, 2] ** 2))
    bent = (np.abs(bow) > _CERTAIN * bow_sigma) & (line.lengths_mm > 2.0 * least_mm)
    offset = off[bent, 1]
    middle = line.places_mm(np.flatnonzero(bent), np.full(bent.sum(), 0.5))
    middle += offset[:, None] * line.normals[bent]
    after = line.starts[bent]
    return join(
        [
            np.insert(line.nodes_mm[first : last + 1], after[here] - first + 1, middle[here], axis=0)
            for first, last in line.pieces
            for here in [(after >= first) & (after < last)]
        ]
    )


def _off(mean_mm: Floats) -> tuple[Floats, Floats]:
    """Medians over the bins (..., bins) and their standard errors; NaN where too few bins know anything."""
    known = np.isfinite(mean_mm).sum(axis=-1)
    enough = known >= _LEAST_BINS
    middle, error = np.full(known.shape, np.nan), np.full(known.shape, np.nan)
    middle[enough] = np.nanmedian(mean_mm[enough], axis=-1)
    scatter = SIGMA_PER_MEDIAN * np.nanmedian(np.abs(mean_mm[enough] - middle[enough, None]), axis=-1)
    error[enough] = MEDIAN_OVER_MEAN * scatter / np.sqrt(known[enough])
    return middle, error
