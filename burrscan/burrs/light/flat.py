"""Is a disturbed place flat after all? Edges of brightness bend the depth, to either side in turn.

A pixel across which the brightness changes sees the columns of its brighter part, so its depth is off by up
to half a pixel's worth (Curless & Levoy 1995, section 2). Across a scratch these errors sum to whatever the
line's place within its pixels makes of them, and where the line wanders over pixels that sum changes its
sign. What stands up or is cut in shows the same depths all along.
"""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Bools, Floats

_BESIDE_CELLS = 2
"""The pixels that an edge crosses reach so far beyond the cells whose depth is off."""
_FEWEST = 2.0
"""Stretches that tell: along a single one a scratch's depths agree as a burr's do."""
_AGREE = 2.0
"""Standard errors from which the depths of a place agree along it."""


def wanders_flat(cells: Bools, deviation_mm: Floats) -> bool:
    """Whether a place runs askew over pixels and its depths cancel along it, as those of a scratch do.

    Parameters
    ----------
    cells
        (rows, columns) of the place on the unrolled surface.
    deviation_mm
        (rows, columns) depth off the surface, NaN where nothing was measured.

    Notes
    -----
    A row's depths are summed across the place. Sums of rows between which the place moves on by a pixel are
    independent, so the place has as many of them as it moves by columns, and one. O(cells).

    """
    rows, columns = np.nonzero(cells)
    used = np.unique(rows)
    sums, middles = np.empty(len(used)), np.empty(len(used))
    for k, row in enumerate(used):
        at = columns[rows == row]
        beside = slice(max(int(at.min()) - _BESIDE_CELLS, 0), int(at.max()) + _BESIDE_CELLS + 1)
        sums[k], middles[k] = np.nansum(deviation_mm[row, beside]), at.mean()
    stretches = 1.0 + abs(float(np.polyfit(used, middles, 1)[0])) * float(used[-1] - used[0])
    agree = abs(float(sums.mean())) * np.sqrt(stretches)
    return bool(stretches >= _FEWEST and agree < _AGREE * float(sums.std()))
