"""Waves: errors of a scan that are alike over more than a burr is wide.

A filter over many pixels, a calibration that is a little off or a part that is not quite round leave
deviations that change slowly along and around the surface. As noise they would hide burrs of ten times their
size, for a mean over a burr's vertices varies as much as one of them does. But no burr is as wide: what its
surroundings have in common is taken off, as a whitening filter would.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from burrscan.arrays import Floats, Ints32
from burrscan.robust import SIGMA_PER_MEDIAN, medians_of

_WINDOW_MM = 15.0
"""Side of the surroundings: five times the width of the widest burr that is asked for."""
WIDEST_MM = 5.0
"""Of what is told from waves once these are off: a third of the window. Wider, its median follows a burr."""
_BLOCKS = 5
"""Blocks along a side of the surroundings: a burr fills one or two of five columns, and no median of them."""
_FEWEST_CELLS = 2
"""Of the residual field along the side of a block: a vertex or two would be its own surroundings."""
_PASSES = 2
"""The median of a window is lower than a crest of a wave in its middle; the rest is taken off once more."""
_PAYS = 0.7
"""What is left of the typical deviation where there are waves; noise of each vertex is all left."""


def without_waves(
    deviation: Floats, cell: Ints32, shape: tuple[int, int], *, step_mm: float, closed: bool
) -> tuple[Floats, Floats] | None:
    """Deviations less the waves that they hold, and by how much these differ around each; None without any.

    Parameters
    ----------
    deviation
        (N,) of the vertices, mm.
    cell
        (N, 2) row and column of each in a grid of cells of ``step_mm``.
    shape
        (rows, columns) of it; ``closed`` if its columns go all the way round.

    Notes
    -----
    O(N log N + blocks).

    """
    size = max(round(_WINDOW_MM / _BLOCKS / step_mm), _FEWEST_CELLS)
    blocks = tuple(-(-side // size) for side in shape)
    block = np.ravel_multi_index((cell[:, 0] // size, cell[:, 1] // size), blocks)
    place, count = (cell + 0.5) / size - 0.5, int(np.prod(blocks))
    left, spread = deviation, np.zeros(len(deviation))
    most = _PAYS * float(np.median(np.abs(deviation)))
    for _ in range(_PASSES):
        middle, scatter = _around(medians_of(left, block, count).reshape(blocks), closed=closed)
        left = left - _between(middle, place, closed=closed)
        if not np.median(np.abs(left)) < most:
            return None
        spread = np.maximum(spread, _between(scatter, place, closed=closed))
    return left, spread


def _around(medians: Floats, *, closed: bool) -> tuple[Floats, Floats]:
    """The median of the blocks around each and the spread about it, NaN for blocks without any vertex."""
    reach = _BLOCKS // 2
    padded = np.pad(medians, ((reach, reach), (0, 0)), constant_values=np.nan)
    if closed:
        padded = np.pad(padded, ((0, 0), (reach, reach)), mode="wrap")
    else:
        padded = np.pad(padded, ((0, 0), (reach, reach)), constant_values=np.nan)
    windows = np.lib.stride_tricks.sliding_window_view(padded, (_BLOCKS, _BLOCKS))
    middle, spread = np.full(medians.shape, np.nan), np.full(medians.shape, np.nan)
    known = np.isfinite(medians)
    some = windows[known].reshape(-1, _BLOCKS**2)
    middle[known] = np.nanmedian(some, axis=1)
    spread[known] = SIGMA_PER_MEDIAN * np.nanmedian(np.abs(some - middle[known][:, None]), axis=1)
    return middle, spread


def _between(image: Floats, place: Floats, *, closed: bool) -> Floats:
    """(N,) bilinear between the blocks that are known, of which each place has one."""
    known = np.isfinite(image)
    sums = [
        ndimage.map_coordinates(values, place.T, order=1, mode="grid-wrap" if closed else "nearest")
        for values in (np.where(known, image, 0.0), known.astype(float))
    ]
    return np.asarray(sums[0] / sums[1])
