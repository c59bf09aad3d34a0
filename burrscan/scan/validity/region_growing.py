"""Columns believed because they continue a surface.

Where interreflected light outweighs the direct light a pattern may follow a mirror image, and a
pixel's own frames cannot tell. A surface can: direct light goes on smoothly from where it dominates, a
mirror image does not join on. And a pixel whose best column is hardly ahead of the others needs no lead once
it lies where its neighbours expect it. So columns are believed from the sure ones outwards, as edges are
followed from strong to weak (Canny 1986, hysteresis).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from burrscan.arrays import Bools, Floats32, Ints

_REACH = 2
"""Pixels to each side that a plane of columns is fitted to: a surface is hardly curved over five."""
_LEAST_SUPPORT = 5
"""Believed pixels: a plane has three unknowns, two more average their noise."""


def grow_regions(
    u_px: Floats32, sigma_px: Floats32, sure: Bools, *, within_px: float = 0.5, within_z: float = 4.0
) -> Bools:
    """Which pixels (h, w) are sure or continue a surface that is.

    Parameters
    ----------
    u_px, sigma_px
        (h, w) columns and stated sigmas, NaN where there is none.
    sure
        (h, w) pixels believed without their neighbours.
    within_px, within_z
        A pixel continues the plane through the believed pixels of the 5×5 around it when it is off by no more
        than ``within_px`` plus so many of its sigmas.

    Notes
    -----
    Breadth first from all sure pixels, so the same for any order of rows. O(pixels).

    """
    known = np.isfinite(u_px)
    found: Bools = _grow(u_px.astype(np.float64), within_px + within_z * sigma_px, known, sure & known)
    return found


@njit(cache=True, nogil=True)
def _grow(u: Floats32, within: Floats32, known: Bools, sure: Bools) -> Bools:
    believed = sure.copy()
    front = np.flatnonzero(sure)
    while len(front):
        front = _next(u, within, known, believed, front)
        for at in front:
            believed[at // u.shape[1], at % u.shape[1]] = True
    return believed


@njit(cache=True, nogil=True)
def _next(u: Floats32, within: Floats32, known: Bools, believed: Bools, front: Ints) -> Ints:
    """The pixels around those just believed that continue the surface as it stands."""
    height, width = u.shape
    tried = np.zeros((height, width), np.bool_)
    found = np.empty(height * width, np.int64)
    count = 0
    for at in front:
        for y in range(max(at // width - _REACH, 0), min(at // width + _REACH + 1, height)):
            for x in range(max(at % width - _REACH, 0), min(at % width + _REACH + 1, width)):
                untried = known[y, x] and not believed[y, x] and not tried[y, x]
                tried[y, x] |= untried
                found[count] = y * width + x  # overwritten unless it counts
                count += untried and abs(_expected(u, believed, y, x) - u[y, x]) <= within[y, x]
    return found[:count].copy()


@njit(cache=True, nogil=True)
def _expected(u: Floats32, believed: Bools, row: int, column: int) -> float:
    """Column that the plane through the believed pixels around expects; NaN where they carry none."""
    n, sx, sy, sxx, sxy, syy, s, tx, ty = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for y in range(max(row - _REACH, 0), min(row + _REACH + 1, u.shape[0])):
        for x in range(max(column - _REACH, 0), min(column + _REACH + 1, u.shape[1])):
            if not believed[y, x]:
                continue
            dx, dy, value = float(x - column), float(y - row), u[y, x]
            n += 1.0
            sx, sy = sx + dx, sy + dy
            sxx, sxy, syy = sxx + dx * dx, sxy + dx * dy, syy + dy * dy
            s, tx, ty = s + value, tx + dx * value, ty + dy * value
    if n < _LEAST_SUPPORT:
        return np.nan
    a, b, c = sxx - sx * sx / n, sxy - sx * sy / n, syy - sy * sy / n
    p, q = tx - sx * s / n, ty - sy * s / n
    det = a * c - b * b
    if not det > 1e-6:
        return np.nan
    gx, gy = (c * p - b * q) / det, (a * q - b * p) / det
    return (s - gx * sx - gy * sy) / n
