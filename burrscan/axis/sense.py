"""What an axis method returns, brought to the sense that every axis has here."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from burrscan.axis.basis import perpendicular_basis, sensed
from burrscan.errors import InputError
from burrscan.inspection import Axis

_UNIT = 1e-6
"""How far a direction's length may be from 1: single precision and a division round by less, a forgotten
division does not."""


def in_sense(axis: Any, *, method: str) -> Axis:
    """The axis with the stated sense, its covariance about the perpendicular directions that follow from it.

    Raises
    ------
    InputError
        When this is no :class:`Axis`, or one without a point and a unit direction.

    """
    if not isinstance(axis, Axis):
        raise InputError(f"axis method '{method}': must return a burrscan.Axis, not {type(axis).__name__}")
    size = float(np.linalg.norm(axis.direction))
    if axis.direction.shape != (3,) or axis.point_mm.shape != (3,) or not np.isfinite(axis.point_mm).all():
        raise InputError(f"axis method '{method}': point_mm and direction must be three finite numbers each")
    if not abs(size - 1.0) < _UNIT:
        raise InputError(f"axis method '{method}': the direction has the length {size:g}: divide it by that")
    direction = sensed(axis.direction)
    if direction is axis.direction:
        return axis
    change = perpendicular_basis(direction).T @ perpendicular_basis(axis.direction)
    turn = np.kron(np.eye(2), change)
    return replace(axis, direction=direction, covariance=turn @ axis.covariance @ turn.T)
