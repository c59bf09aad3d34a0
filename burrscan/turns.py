"""Differences of angles: the shorter way round."""

from __future__ import annotations

from typing import overload

import numpy as np

from burrscan.arrays import Floats


@overload
def turn_rad(angle: float) -> float: ...
@overload
def turn_rad(angle: Floats) -> Floats: ...
def turn_rad(angle: float | Floats) -> float | Floats:
    """Angles, radians, as turns from -π to below π."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


@overload
def turn_deg(angle: float) -> float: ...
@overload
def turn_deg(angle: Floats) -> Floats: ...
def turn_deg(angle: float | Floats) -> float | Floats:
    """Angles, degrees, as turns from -180 to below 180."""
    return (angle + 180.0) % 360.0 - 180.0
