"""Vertices that coincide count once: many file formats repeat a vertex for every face that uses it."""

from __future__ import annotations

import numpy as np
from numba import njit

from burrscan.arrays import Floats, Ints, Ints32


def welded(
    vertices_mm: Floats, faces: Ints32, sigma_mm: Floats | None
) -> tuple[Floats, Ints32, Floats | None, Ints32]:
    """Make one vertex of those with exactly the same coordinates.

    Parameters
    ----------
    vertices_mm, faces
        (V, 3) finite positions and (T, 3).
    sigma_mm
        (V,) standard deviations, or None.

    Returns
    -------
    (U, 3) vertices in the order in which they first appear, the faces between them, their least sigma, and
    (V,) which of the U stands for each given vertex. O(V + T), by hashing.

    """
    bits = np.ascontiguousarray(vertices_mm + 0.0).view(np.int64)  # -0 and 0 are the same place
    first, number = _numbered(bits, 1 << (2 * len(bits)).bit_length())
    if len(first) == len(number):
        return vertices_mm, faces, sigma_mm, number
    least = None
    if sigma_mm is not None:
        least = np.full(len(first), np.inf)
        np.minimum.at(least, number, sigma_mm)
    return vertices_mm[first], number[faces], least, number


@njit(cache=True, nogil=True)
def _numbered(bits: Ints, slots: int) -> tuple[Ints32, Ints32]:
    table = np.full(slots, -1, np.int32)
    first, number = np.empty(len(bits), np.int32), np.empty(len(bits), np.int32)
    mask, count = slots - 1, 0
    for i in range(len(bits)):
        a, b, c = bits[i, 0], bits[i, 1], bits[i, 2]
        key = (a * 31 + b) * 0x5851F42D4C957F2D + c
        key = (key ^ (key >> 29)) * 0x2545F4914F6CDD1D
        slot = (key ^ (key >> 32)) & mask
        while table[slot] >= 0:
            j = first[table[slot]]
            if bits[j, 0] == a and bits[j, 1] == b and bits[j, 2] == c:
                break
            slot = (slot + 1) & mask
        if table[slot] < 0:
            table[slot] = count
            first[count] = i
            count += 1
        number[i] = table[slot]
    return first[:count], number
