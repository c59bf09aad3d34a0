"""How high a burr on an edge is: as high as its vertices reach.

Beyond an edge all vertices have the edge as their nearest place. On the unrolled surface a burr's flank there
is a wall without width, of which a ridge would take the middle. But one sees a flank up to the crest.
"""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats
from burrscan.burrs.shape.along import largest
from burrscan.burrs.shape.patch import Patch

_UPPER = 0.5
"""Share of a height from which vertices are on the flank's upper part, evenly spread over its height."""
_FEWEST = 4
"""Vertices of a stretch in that part: where they end is known to a fifth of it then."""
_NOISE = 2.0
"""In sigma: vertices that far below the highest may be as high as it but for their noise."""


def crest_of(patch: Patch, extent: tuple[float, float], *, least_mm: float) -> tuple[float, float] | None:
    """Largest height along the burr and its standard deviation, mm; None from too few vertices.

    In each stretch the vertices of the flank's upper half are taken as evenly spread up to the crest, as a
    scan's rows are. The kth of N from above then lies (k - 1/2) / N of their range below it. O(N log N).

    Parameters
    ----------
    patch
        The vertices of the burr.
    extent
        Where it begins and ends along u, mm.
    least_mm
        Least length over which a height is stated.

    """
    length = extent[1] - extent[0]
    count = max(int(length / least_mm), 1)
    stretch = np.floor((patch.u_mm - extent[0]) / length * count)
    tops = [_top(patch.lift_mm[on], patch.sigma_mm[on]) for on in (stretch == k for k in range(count))]
    known = [top for top in tops if top is not None]
    if not known:
        return None
    height, sigma = np.array(known).T
    weight = sigma**-2.0
    common = float(weight @ height / weight.sum())
    gain, gain_sigma = largest(height / common, weight * common**2)
    return common * gain, float(np.hypot(1.0 / np.sqrt(weight.sum()), common * gain_sigma))


def _top(lift: Floats, sigma: Floats) -> tuple[float, float] | None:
    """Where the lifts on a flank end, and how sure."""
    low = _UPPER * float(lift.max(initial=0.0))
    upper = np.sort(lift[lift > low])[::-1]
    if len(upper) < _FEWEST:
        return None
    noise = float(np.median(sigma[lift > low]))
    from_above = int(np.clip(np.count_nonzero(upper > upper[0] - _NOISE * noise), 1, len(upper) // 2))
    share = (from_above - 0.5) / len(upper)
    top = low + (float(upper[from_above - 1]) - low) / (1.0 - share)
    spread = (top - low) * np.sqrt(share * (1.0 - share) / len(upper)) / (1.0 - share)
    return top, float(np.hypot(spread, noise / np.sqrt(from_above)))
