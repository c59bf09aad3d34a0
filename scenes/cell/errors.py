"""Where a positioner goes when it is told to go somewhere: ISO 9283's accuracy and repeatability, drawn."""

from __future__ import annotations

import zlib

import numpy as np
from scipy.spatial.transform import Rotation

from burrscan.arrays import Floats
from burrscan.cell.positioner import PositionerSheet
from burrscan.pose import exponential

_WAVES = 4
"""Of which the error of accuracy is a sum; few, so that it is smooth."""
_LENGTH_MM, _TURN_RAD = 600.0, 1.2
"""Over such a way, or turn, the error of accuracy changes by about itself: an arm's errors are those of its
joints' zeros and links, which act over its whole workspace."""


class AttainedPoses:
    """Poses that a positioner attains, drawn from its data sheet.

    The error of accuracy is a smooth function of the commanded pose, a sum of waves with random directions;
    that of repeatability is new in each move. Both act in the frame of the flange.
    """

    def __init__(self, sheet: PositionerSheet, *, identity: tuple[int, ...], source: str) -> None:
        sequence = np.random.SeedSequence(identity, spawn_key=(zlib.crc32(source.encode()),))
        self._rng = np.random.default_rng(sequence)
        directions = self._rng.normal(size=(6, _WAVES, 6))
        self._waves = directions / np.array([_LENGTH_MM] * 3 + [_TURN_RAD] * 3)
        self._phases = self._rng.uniform(0.0, 2.0 * np.pi, size=(6, _WAVES))
        self._offset = np.array([sheet.offset_mm] * 3 + [np.radians(sheet.offset_deg)] * 3)
        self._scatter = np.array([sheet.scatter_mm] * 3 + [np.radians(sheet.scatter_deg)] * 3)

    def attained(self, T_commanded: Floats) -> Floats:
        """(4, 4) where a move to ``T_commanded`` ends this time."""
        return T_commanded @ motion(self.offset(T_commanded) + self._scatter * self._rng.normal(size=6))

    def offset(self, T_commanded: Floats) -> Floats:
        """(6,) error of accuracy there: mm along and rad about the axes of the flange."""
        turn = Rotation.from_matrix(T_commanded[:3, :3]).as_rotvec()
        place = np.concatenate([T_commanded[:3, 3], turn])
        waves = np.sin(self._waves @ place + self._phases)
        return np.asarray(self._offset * np.sqrt(2.0 / _WAVES) * waves.sum(axis=1))


def motion(twist: Floats) -> Floats:
    """(4, 4) rigid motion of (6,): mm along and rad about the axes."""
    return exponential(np.concatenate([twist[3:], twist[:3]]))
