"""Depths that are no more than noise: each cell another, and none farther off than the scan itself says.

In a dark stain the light is off, and depths err by more than elsewhere on their parallel. A burr's depths are
a surface's: neighbours agree, whether they are its flanks or what bounced off them.
"""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Bools, Floats, Ints

_NOTHING_MM = 1e-12
"""A cell on the surface itself may state no error: it is 0 of its deviations off."""
_STATED = 2.0
"""Median size of a noisy place's depths in what is stated of them, at most: of all of a noise it is 0.7, but
a place has the larger ones. Five places of noise on 237 random wheels had 1.2 to 1.4, nine in ten burrs 3 and
more."""
_AGREE = 2.5
"""Standard deviations of the correlation of neighbours that noise stays below: the five had 1.8 at most, of
the 17 burrs in 810 with as little depth all but three 2.7 and more."""
_FEWEST = 6
"""Pairs of neighbours, without which nothing is said of their agreement."""


def depths_are_noise(cells: Bools, deviation_mm: Floats, stated_mm: Floats, pixel: Ints) -> bool:
    """Whether the depths of a place tell of nothing.

    Parameters
    ----------
    cells
        (rows, columns) of the place on the unrolled surface.
    deviation_mm, stated_mm
        (rows, columns) depth off the surface, NaN where nothing was measured, and its standard deviation.
    pixel
        (2, rows, columns) where a cell's depth was measured: two cells of one pixel are no two witnesses.

    Notes
    -----
    Pairs of neighbours whose depths have nothing in common correlate by 0 ± 1/√pairs. O(n log n) of the
    place's cells.

    """
    rows, columns = np.nonzero(cells & np.isfinite(deviation_mm))
    if not len(rows):
        return False
    near = slice(rows.min(), rows.max() + 1), slice(columns.min(), columns.max() + 1)
    depth = np.where(cells, deviation_mm, np.nan)[near]
    width = int(pixel[1].max()) + 1
    here, there = _neighbours(depth, (pixel[0] * width + pixel[1])[near])
    size = float(np.sqrt((here @ here) * (there @ there)))
    if len(here) < _FEWEST or size == 0.0:
        return False
    agrees = float(here @ there) / size * np.sqrt(len(here)) >= _AGREE
    known = np.isfinite(depth)
    stated = np.maximum(stated_mm[near][known], _NOTHING_MM)
    return bool(not agrees and np.median(np.abs(depth[known]) / stated) < _STATED)


def _neighbours(depth: Floats, pixel: Ints) -> tuple[Floats, Floats]:
    """(N,) and (N,) depths of cells beside one another, each pair of pixels once."""
    pairs = [
        (depth[:-1], depth[1:], pixel[:-1], pixel[1:]),
        (depth[:, :-1], depth[:, 1:], pixel[:, :-1], pixel[:, 1:]),
    ]
    here, there, one, other = (
        np.concatenate([each.ravel() for each in part]) for part in zip(*pairs, strict=True)
    )
    both = np.isfinite(here) & np.isfinite(there) & (one != other)
    _, first = np.unique(np.stack([one[both], other[both]]), axis=1, return_index=True)
    return here[both][first], there[both][first]
