"""What every burr becomes before it meets the wheel: a lofted solid and what is known of it exactly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.interpolate import PchipInterpolator

from burrscan.arrays import Floats, freeze

SINK_MM = 0.2
"""How far a burr's root reaches into the wheel (a nick's tool out of it), so that the boolean is robust."""
OVERLAP_MM = 0.02
"""How far the flanks run on through the surface before they turn to the root."""
_KNOT_MM = 4.0


@dataclass(frozen=True)
class Tool:
    """A solid to unite with the wheel or to cut from it.

    Parameters
    ----------
    stations_mm
        (N, 5, 3) rings for :func:`scenes.wheel.loft.loft`.
    side
        ``protrusion`` is united, ``nick`` cut.
    angle_deg, z_start_mm, z_end_mm, width_mm, length_mm
        Of the burr, as in :class:`scenes.wheel.truth.TrueBurr`.
    arc_deg
        Angular extent.

    """

    stations_mm: Floats
    side: Literal["protrusion", "nick"]
    angle_deg: float
    z_start_mm: float
    z_end_mm: float
    width_mm: float
    length_mm: float
    arc_deg: float

    def __post_init__(self) -> None:
        freeze(self, stations_mm=self.stations_mm)

    @property
    def crest_mm(self) -> Floats:
        """(N, 3) its crest, or a nick's bottom line."""
        return self.stations_mm[:, 0]


def varying_heights(positions_mm: Floats, *, height_mm: float, variation: float, seed: int) -> Floats:
    """(N,) heights along a burr: smooth, pseudo-random, the largest exactly ``height_mm``.

    Random knots 4 mm apart, joined monotonically (Fritsch & Carlson 1980), fill the span from
    ``height_mm * (1 - variation)`` to ``height_mm``.
    """
    span = float(positions_mm[-1] - positions_mm[0])
    knots = max(4, int(np.ceil(span / _KNOT_MM)) + 1)
    values = np.random.default_rng(seed).uniform(size=knots)
    course = PchipInterpolator(np.linspace(positions_mm[0], positions_mm[-1], knots), values)(positions_mm)
    course = (course - course.min()) / max(float(np.ptp(course)), 1e-12)
    course = course if variation > 0.0 else np.ones_like(course)
    return np.asarray(height_mm * (1.0 - variation * (1.0 - course)))
