"""Errors that neighbouring vertices share: they do not average out over a burr.

Bounced light, smeared edges and ripples of the patterns displace whole patches of a scan. A scanner states a
larger sigma there, but not that neighbours err alike. How large such errors are among vertices that are as
doubtful as a burr's own is seen in the rest of the scan: in how far vertices deviate, beyond what neighbours
differ from each other by.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Bools, Floats, Ints
from burrscan.burrs.field import Field
from burrscan.burrs.noise.border import border_spread_mm

_SHARE, _GAUSSIAN = 0.8, 1.2816
"""Burrs are less than a fifth of their like; a Gaussian's amount stays below 1.28 sigma so often."""
_FEWEST = 300
"""Vertices: a quantile of 80 % of so many is known to 5 %; with fewer the class of the alike is widened."""
_FEWEST_BORDERS = 50
"""Vertices: a quantile of 98 % of fewer is the largest of them."""
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
    return Doubt(np.log2(noise), size, _roughness(field.deviation_mm, noise, field.flat_cell))


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
        shared = max(shared, border_spread_mm(field.deviation_mm[_borders_like(field, crest, apart)]))
    return Noise(own, shared)


def _borders_like(field: Field, crest: Ints, apart: Bools) -> Bools:
    """(N,) True for vertices on borders, those of the same parallels where there are enough.

    Along a parallel the mesh ends in the same way, at a limb in another than at a shadow.
    """
    rows = np.zeros(len(field.count), dtype=np.bool_)
    rows[field.cell[crest, 0]] = True
    every: Bools = field.border & apart
    near: Bools = every & rows[field.cell[:, 0]]
    return near if np.count_nonzero(near) >= _FEWEST_BORDERS else every


def _by_their_like(doubt: Doubt, like: Floats, apart: Bools) -> tuple[float, float]:
    """Own and shared standard deviation, mm, of vertices of such grades."""
    middle, reach, count = float(np.median(like)), _OCTAVES / 2.0, 0
    total, own = 1.0, 1.0
    while count < min(_FEWEST, len(apart) // 2) and reach < 32.0:
        reach *= 2.0
        count, total, own = _spreads(doubt, apart & (np.abs(doubt.grade - middle) <= reach))
    total = max(total, 1.0)
    own = min(own, total)
    return own * 2.0**middle, float(np.sqrt(total**2 - own**2)) * 2.0**middle


def _spreads(doubt: Doubt, alike: Bools) -> tuple[int, float, float]:
    """How many vertices are alike, and the robust spread of their sizes and of their roughness."""
    rough = doubt.rough[alike]
    return int(alike.sum()), _spread(doubt.size[alike]), _spread(rough[np.isfinite(rough)])


def _spread(sizes: Floats) -> float:
    """The spread of which the 80 % point of some sizes tells; 1 without any."""
    return float(np.quantile(sizes, _SHARE)) / _GAUSSIAN if len(sizes) else 1.0


def _roughness(deviation: Floats, noise: Floats, flat: Ints) -> Floats:
    """(N,) difference to the vertex before it in its cell over the root of two, in units of both's noise."""
    order = np.argsort(flat, kind="stable")
    same = flat[order[1:]] == flat[order[:-1]]
    own, before = order[1:][same], order[:-1][same]
    rough = np.full(len(deviation), np.nan)
    rough[own] = np.abs(deviation[own] - deviation[before]) / np.hypot(noise[own], noise[before])
    return rough
