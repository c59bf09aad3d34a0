"""Burrs narrower than a pixel: lines along the generatrix whose light and depth are off in the mean.

Such a burr is a dark or bright line that shows a tenth of its height here and there: no cell of it is sure.
Fifteen together are. A scratch has as strong a line of light and edges that bend the depth to either side
(:mod:`burrscan.burrs.light.flat`); it runs in any direction, a burr of this kind along the generatrix.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from burrscan.arrays import Bools, Floats
from burrscan.robust import SIGMA_PER_MEDIAN

_ROWS = 15
"""Cells of a line that are judged together: half of a short burr."""
_DEPTH_Z = 6.0
"""Robust standard deviations, of all such lines, by which the depth of one is off. In 696 scans of rendered
wheels six lines without burrs have 3.6 to 6.6, and one on matt paint 9.9; of 97 on burrs that no cell
tells 75 have more."""
_CONTRAST = 0.3
"""Excess of the logarithm of the light that a line has, and what is beside it has not: twice what finishes
vary by from place to place."""
_ALIKE = 0.7
"""Share of a line's cells that have it, all of one sign: of a scratch 10 degrees askew, in a column of cells,
half have."""
_CLIP_Z = 8.0
"""Of one cell in a line: more cells than one must speak."""
_KNOWN_LIGHT, _KNOWN_DEPTH = 0.8, 0.5
"""Shares of a line that must be known: light is nearly everywhere, depth is not beside what stands up."""
_DRIFT = 0.063
"""Cells to the side, for each along the generatrix, up to which a line runs along it: 3.6 degrees, which of
scratches in all directions is one in 25, as for lines that the depth tells of."""
_FOLLOWED = 60
"""Cells to either end over which a line is followed: beyond them an angle of that size is known."""
_FEWEST = 4
"""Rows over which that angle says anything."""
_BESIDE = 4
"""Cells to either side. Before them the light is as usual again beside a thin burr, not beside a patch; and
what lies no further from another place is that one's flank, shadow or mirror image."""


def lines(rest: Floats, strange: Bools, depth_z: Floats, open_cells: Bools, taken: Bools) -> Bools:
    """(rows, columns) cells of all lines, where no other place was found.

    Parameters
    ----------
    rest
        (rows, columns) excess of the logarithm of the light, NaN where it is not known.
    strange
        (rows, columns) where it is more than the finish varies by on that parallel.
    depth_z
        (rows, columns) depth off the surface in the standard deviations of its row, NaN where not measured.
    open_cells
        (rows, columns) what camera and projector both see.
    taken
        (rows, columns) cells of other places.

    Notes
    -----
    What is judged is the mean depth of so many cells, in their standard deviations, against that of all such
    lines. O(cells · lines).

    """
    lit, deep = (open_cells & np.isfinite(each) for each in (rest, depth_z))
    light, depth = _summed(lit.astype(float)), _summed(deep.astype(float))
    full = (light >= _KNOWN_LIGHT * _ROWS) & (depth >= _KNOWN_DEPTH * _ROWS)
    if not full.any():
        return full
    shown = np.where(lit & strange & (np.abs(rest) > _CONTRAST), np.sign(rest), 0.0)
    alike = np.abs(_summed(shown))[full] / light[full]
    z = _summed(np.where(deep, np.clip(depth_z, -_CLIP_Z, _CLIP_Z), 0.0))[full] / np.sqrt(depth[full])
    usual = SIGMA_PER_MEDIAN * float(np.median(np.abs(z)))
    full[full] = (np.abs(z) > _DEPTH_Z * usual) & (alike >= _ALIKE)
    line = open_cells & ndimage.binary_dilation(full, np.ones((_ROWS, 1), bool))
    labels, count = ndimage.label(line, np.ones((3, 3), bool))
    near = ndimage.binary_dilation(taken, np.ones((2 * _BESIDE + 1, 2 * _BESIDE + 1), bool))
    each = (labels == number for number in range(1, count + 1))
    apart = (cells for cells in each if (cells & lit).any() and not (cells & near).any())
    thin = [cells for cells in apart if _is_thin(cells, rest) and abs(_drift(cells, rest)) <= _DRIFT]
    return np.asarray(np.logical_or.reduce([np.zeros(line.shape, bool), *thin]))


def _summed(values: Floats) -> Floats:
    return np.asarray(ndimage.correlate1d(values, np.ones(_ROWS), axis=0, mode="constant"))


def _is_thin(cells: Bools, rest: Floats) -> bool:
    """Whether the light is soon as usual again to both sides: else it is the edge of a patch."""
    rows, columns = np.nonzero(cells)
    off = np.nan_to_num(np.abs(rest[np.unique(rows)]))
    sides = off[:, max(columns.min() - _BESIDE, 0) : columns.min()], off[:, columns.max() + 1 :][:, :_BESIDE]
    return all(side.size > 0 and np.median(side, axis=0).min() <= _CONTRAST for side in sides)


def _drift(cells: Bools, rest: Floats) -> float:
    """Cells to the side for each along the generatrix that a line's light moves, followed from its middle."""
    rows, columns = np.nonzero(cells)
    shown = np.nan_to_num(rest * np.sign(np.nanmedian(rest[cells])))
    start, middle = int(np.median(rows)), float(np.median(columns))
    path = {start: middle}
    for ends in (
        range(start, min(start + _FOLLOWED, len(rest))),
        range(start, max(start - _FOLLOWED, -1), -1),
    ):
        at = middle
        for row in ends:
            near = np.arange(max(round(at) - 2, 0), min(round(at) + 3, rest.shape[1]))
            weight = np.maximum(shown[row, near] - 0.5 * _CONTRAST, 0.0)
            if not weight.any():
                break
            at = path[row] = 0.5 * (at + float(weight @ near) / float(weight.sum()))
    row, column = np.array(list(path.items())).T
    return float(np.polyfit(row, column, 1)[0]) if len(path) > _FEWEST else 0.0
