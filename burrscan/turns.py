"""Differences of angles: the shorter way round."""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from burrscan.arrays import Floats

Angle = TypeVar("Angle", float, Floats)


def turn_rad(angle: Angle) -> Angle:
    """Angles, radians, as turns from -π to below π."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


def turn_deg(angle: Angle) -> Angle:
    """Angles, degrees, as turns from -180 to below 180."""
    return (angle + 180.0) % 360.0 - 180.0
