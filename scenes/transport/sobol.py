"""Scrambled Sobol points inside a traced kernel, a sequence of its own for every camera pixel.

The points are those of Joe & Kuo (2008), as SciPy tabulates them, scrambled in nested uniform fashion (Owen
1995) by a hash instead of stored permutations (Burley 2020, "Practical hash-based Owen scrambling", JCGT 9;
the hash is Laine & Karras's of 2011 with Vegdahl's constants). Each point is uniform on the unit cube, so any
integral stays unbiased, and 2^k points of one pixel are a net: where the integrand is smooth the error falls
faster than that of independent points. Two pixels have nothing in common but the table.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray

DIMENSIONS = 6
"""The directions of two turns (2 each), and the place in the pixel (2)."""


def reversed_points(points: int) -> NDArray[np.uint32]:
    """The first ``points`` Sobol points as bit-reversed integers, (DIMENSIONS · points,).

    The first 2^k are a net, and so is each half, quarter ... of them in a row. Reversed, because the
    scrambling works from the least significant bit upwards.
    """
    from scipy.stats import qmc  # noqa: PLC0415 (a third of a second)

    engine = qmc.Sobol(DIMENSIONS, scramble=False, bits=32)
    first = np.rint(engine.random(points) * 2.0**32).astype(np.uint64).astype(np.uint32)
    bits = np.unpackbits(np.ascontiguousarray(first.T).astype(">u4").view(np.uint8), bitorder="big")
    back = np.packbits(bits.reshape(-1, 32)[:, ::-1], axis=1, bitorder="big")
    return np.ascontiguousarray(back.reshape(-1, 4)).view(">u4").astype(np.uint32).ravel()


def point(mi: Any, table: Any, index: Any, key: Any, axes: range = range(DIMENSIONS)) -> list[Any]:
    """Coordinates in [0, 1) of row ``index`` of :func:`reversed_points`, scrambled by ``key`` (a UInt32).

    ``axes`` says which of them.
    """
    count = dr.opaque(mi.UInt32, dr.width(table) // DIMENSIONS)
    return [
        _unit(mi, _scrambled(mi, dr.gather(mi.UInt32, table, index + axis * count), _hash(mi, key, axis)))
        for axis in axes
    ]


def _hash(mi: Any, key: Any, axis: int) -> Any:
    """A word for each axis; the last step of MurmurHash3 (Appleby 2011), a third of the cost of a cipher."""
    x = key + mi.UInt32(0x9E3779B9 * (axis + 1) & 0xFFFFFFFF)
    x = (x ^ (x >> 16)) * mi.UInt32(0x85EBCA6B)
    x = (x ^ (x >> 13)) * mi.UInt32(0xC2B2AE35)
    return x ^ (x >> 16)


def _scrambled(mi: Any, x: Any, key: Any) -> Any:
    """Nested uniform scrambling of bit-reversed x."""
    x = x ^ (x * mi.UInt32(0x3D20ADEA))
    x += key
    x *= (key >> 16) | 1
    x = x ^ (x * mi.UInt32(0x05526C56))
    x = x ^ (x * mi.UInt32(0x53A22864))
    return dr.brev(x)


def _unit(mi: Any, x: Any) -> Any:
    return mi.Float(x >> 8) * (1.0 / (1 << 24))
