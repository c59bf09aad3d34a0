"""Vertices that are nowhere near the part: a scanner's wild points, a marker such as -99999."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Bools, Floats

WILD = 100.0
"""Times the bulk's radius: farther out nothing is the part's."""
FAR = 8.0
"""Times the bulk's radius: farther out, a vertex may be the part's, but has no say in where its middle is."""
_BULK = 0.9
"""Share of the vertices within the bulk's radius: below 1 - the largest share of strays, which then do not
move it."""
_MOST = 0.01
"""Share: more that are far out are a part of the part, or a second one, and nobody's strays."""
_LOOKED_AT = 100_000
"""Vertices, evenly thinned, for median and radius: bounds the time; both are known to far better than a
percent."""


def beyond(vertices_mm: Floats, *, times: float) -> Bools:
    """(V,) whether a vertex is out by more than ``times`` the radius about the median that holds 90 %.

    At most a percent of all: where more are out they are no strays, and none is named. Finite vertices only.
    O(V).
    """
    none: Bools = np.zeros(len(vertices_mm), bool)
    if not len(vertices_mm):
        return none
    some = vertices_mm[:: -(-len(vertices_mm) // _LOOKED_AT)]
    middle = np.median(some, axis=0)
    with np.errstate(over="ignore", invalid="ignore"):
        reach = np.quantile(_greatest(some - middle), _BULK)
        out: Bools = _greatest(vertices_mm - middle) > times * reach
    return out if reach > 0.0 and out.mean() <= _MOST else none


def _greatest(offset_mm: Floats) -> Floats:
    """(V,) greatest part of each (V, 3): squares of wild numbers overflow. Columns are ten times as fast."""
    return np.maximum(np.maximum(*np.abs(offset_mm[:, :2].T)), np.abs(offset_mm[:, 2]))
