"""Errors that neighbouring vertices share: they do not average out over a burr.

Bounced light, smeared edges and ripples of the patterns displace whole patches of a scan. A scanner states a
larger sigma there, but not that neighbours err alike. How large such errors are among vertices that are as
doubtful as a burr's own is seen in the rest of the scan: in how far vertices deviate, beyond what neighbours
differ from each other by.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from burrscan.arrays import Bools, Floats, Ints, Ints32
from burrscan.burrs.border import border_spread_mm
from burrscan.burrs.field import Field

_SHARE, _GAUSSIAN = 0.8, 1.2816
"""Burrs are less than a fifth of their like; a Gaussian's amount stays below 1.28 sigma so often."""
_FEWEST = 300
_OCTAVES = 0.5
"""Vertices are alike whose noise differs by no more than so many factors of two."""


@dataclass(frozen=True)
class Noise:
    """What vertices of a kind err by.

    Parameters
    ----------
    own_mm
        Standard deviation of the part that is each vertex's own.
    shared_mm
        Standard deviation of the part that it has in common with its neighbours.

    """

    own_mm: float
    shared_mm: float

    @property
    def shared_share(self) -> float:
        """Share of the variance that is common to neighbours."""
        return self.shared_mm**2 / max(self.own_mm**2 + self.shared_mm**2, 1e-300)


@dataclass(frozen=True)
class Doubt:
    """How doubtful every vertex of a field is, and what such vertices show.

    Parameters
    ----------
    grade
        (N,) log2 of the noise that the data show locally, or that is stated where that is larger.
    size, rough
        (N,) deviation, and difference to a neighbour over the root of two, in units of that noise; ``rough``
        is NaN for a vertex with no neighbour.

    """

    grade: Floats
    size: Floats
    rough: Floats


def doubt_of(field: Field) -> Doubt:
    """Grade all vertices. O(N)."""
    noise = np.maximum(field.local_mm, field.stated_mm)
    size = np.abs(field.deviation_mm) / noise
    return Doubt(np.log2(noise), size, _roughness(field.deviation_mm, noise, field.cell, field.count.shape))


def noise_around(field: Field, doubt: Doubt, crest: Ints, near: Ints, *, ragged: bool) -> Noise:
    """What the vertices ``crest`` may err by, judged by vertices like them that are not ``near``. O(N).

    What is stated beyond the noise that their parallel and their sector show is held to be shared: light that
    is too little makes whole sectors noisy, not spots. Where most of an anomaly is on the border of the mesh
    (``ragged``) the rest shares the border's errors.
    """
    apart = np.ones(len(doubt.grade), dtype=np.bool_)
    apart[near] = False
    own, shared = _by_their_like(doubt, doubt.grade[crest], apart)
    beyond = np.median(field.stated_mm[crest] ** 2 - field.local_mm[crest] ** 2)
    shared = max(shared, float(np.sqrt(max(beyond, 0.0))))
    if ragged:
        shared = max(shared, border_spread_mm(field.deviation_mm[field.border & apart]))
    return Noise(own, shared)


def _by_their_like(doubt: Doubt, like: Floats, apart: Bools) -> tuple[float, float]:
    """Own and shared standard deviation, mm, of vertices of such grades."""
    middle = float(np.median(like))
    off = np.abs(doubt.grade - middle)
    off[~apart] = np.inf
    reach = _OCTAVES
    while np.count_nonzero(off <= reach) < min(_FEWEST, len(off) // 2) and reach < 64.0:
        reach *= 2.0
    alike = off <= reach
    rough = doubt.rough[alike]
    total = max(_spread(doubt.size[alike]), 1.0)
    own = min(_spread(rough[np.isfinite(rough)]), total)
    return own * 2.0**middle, float(np.sqrt(total**2 - own**2)) * 2.0**middle


def _spread(size: Floats) -> float:
    return float(np.quantile(size, _SHARE)) / _GAUSSIAN if len(size) else 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def _roughness(deviation: Floats, noise: Floats, cell: Ints32, shape: tuple[int, int]) -> Floats:
    """(N,) difference to the vertex before it in its cell over the root of two, in units of both's noise."""
    last = np.full(shape, -1, np.int64)
    rough = np.full(len(deviation), np.nan)
    for i in range(len(deviation)):
        j = last[cell[i, 0], cell[i, 1]]
        if j >= 0:
            both = noise[i] * noise[i] + noise[j] * noise[j]
            rough[i] = abs(deviation[i] - deviation[j]) / np.sqrt(both)
        last[cell[i, 0], cell[i, 1]] = i
    return rough
