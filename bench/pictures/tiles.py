"""Close-ups of what is on a wheel: which scene, which thing on it, from where."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Floats
from scenes.surface.chart import Chart
from scenes.wheel import Wheel


@dataclass(frozen=True)
class Tile:
    """One close-up.

    Parameters
    ----------
    title
        What it shows.
    scene
        Of the catalogue.
    angle_deg, z_mm
        Place on the outermost surface that is in its middle.
    field_mm
        Width of what it shows.
    turned_deg
        By how much that place is turned away from the camera: positive to the right, towards the projector.
    elevation_deg
        Of the pose: above 0 the wheel is seen from above.
    """

    title: str
    scene: str
    angle_deg: float
    z_mm: float
    field_mm: float = 22.0
    turned_deg: float = -20.0
    elevation_deg: float = 42.0

    def middle_mm(self, wheel: Wheel) -> Floats:
        """(3,) the place, in the part frame."""
        z, r = Chart(wheel.generatrix_zr_mm).outermost_zr(self.z_mm)
        at = np.radians(self.angle_deg)
        return np.array([r * np.cos(at), r * np.sin(at), z])


_HIGHLIGHT = {"turned_deg": 7.0, "elevation_deg": 4.0}
"""Beside the place that mirrors the projector into the camera, half of the 18 degrees between them."""
_FAMILIES, _BLEMISHES = "burr_families", "blemishes"

TILES = (
    Tile("triangle: the control, shines as the wheel", _FAMILIES, 0.0, 8.0),
    Tile("rounded: a Poisson burr", _FAMILIES, 40.0, 8.0),
    Tile("rolled: a rollover burr, undercut", _FAMILIES, 80.0, 10.0, field_mm=12.0),
    Tile("flake: a tear burr with gaps", _FAMILIES, 120.0, 4.0),
    Tile("flake: a cut-off stump", _FAMILIES, 160.0, 9.0, field_mm=18.0),
    Tile("rim burr, rolled over the edge", _FAMILIES, -40.0, 13.0, field_mm=26.0),
    Tile("nick, torn out", _FAMILIES, -120.0, 9.0),
    Tile("zone: ground above, turned below", _BLEMISHES, -4.0, 8.0, **_HIGHLIGHT),
    Tile("stain", _BLEMISHES, -8.0, 2.0, **_HIGHLIGHT),
    Tile("bright spot", _BLEMISHES, 25.0, 2.0, **_HIGHLIGHT),
    Tile("scratch, 3 um deep", _BLEMISHES, -25.0, 1.0, **_HIGHLIGHT),
    Tile("chatter, ripple of 6 um", _BLEMISHES, 0.0, -20.0, field_mm=40.0, **_HIGHLIGHT),
)
