"""How wrong interreflected light makes the height of a burr.

On metal a burr's flanks mirror the wheel and the wheel mirrors them, and what one pixel sees of both moves
its depth by much more than its noise; a matt part does none of that. But the walls of a nick light each other
on any part, and what a wall sends on comes with the other wall's columns: the nick looks shallower.
"""

from __future__ import annotations

import numpy as np

from burrscan.burrs.light.side import Looks, tilts_deg
from burrscan.burrs.light.unrolled import Unrolled
from burrscan.inspection import Burr

_NEAR_DEG = 30.0
"""Tilts within which a matt surface hardly changes: the cosine of the incidence, by a fifth."""
_ROWS = 40
"""That are looked at."""
MIRRORED = 0.2
"""Error of heights on what shines beyond what noise explains, as a share of the height: with it the pulls of
256 rendered burrs (seven finishes, all families) have a root mean square of 1.1."""


def walls_share(burr: Burr) -> float:
    """Share of a nick's depth that light from wall to wall may hide; 0 for what stands up.

    That of its light which one wall of a V sends to the other: 1 - sin of half the opening (Hottel's crossed
    strings, 1954). All of it hides as much at the bottom where the walls send everything on.
    """
    if burr.side != "nick":
        return 0.0
    half = 0.5 * burr.width_mm.value
    return float(1.0 - half / np.hypot(half, burr.height_mm.value))


def mirrored(looks: Looks, surface: Unrolled) -> float:
    """How much of the light is mirrored, from 0 on a matt part to 1 on one that shines.

    The light of a parallel falls off beside its highlight: by a factor that tells it.
    O(rows looked at · columns).
    """
    known = np.flatnonzero((surface.open & np.isfinite(looks.predicted)).any(axis=1))
    rows = known[:: max(len(known) // _ROWS, 1)]
    near = surface.open[rows] & (np.abs(tilts_deg(surface, rows)) < _NEAR_DEG)
    falls = []
    for row, beside in zip(rows, near, strict=True):
        light = looks.predicted[row, beside]
        if np.isfinite(light).any():
            falls.append(float(np.nanmax(light) - np.nanmin(light)))
    return float(1.0 - np.exp(-np.median(falls))) if falls else 0.0
