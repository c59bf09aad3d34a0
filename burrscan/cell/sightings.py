"""A burr's place over the mill from several looks.

The last one measures it; those before it help by as much as the arm's moves since are known.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from burrscan.arrays import Floats
from burrscan.cell.positioner import PositionerSheet

_YAW_RAD = np.radians(1.0)
"""How well the burr's direction on the surface is known: a look that finds its middle elsewhere along its
length sees another place of its line."""
_ALIKE = 0.5
"""Correlation of what looks from one pose err by: noise is new in each, what a flank mirrors is not."""


class Sighting(NamedTuple):
    """A burr in one look.

    Parameters
    ----------
    T_base_burr, T_base_flange
        (4, 4) the burr by this look, and the flange, both by the arm's word.
    across_sigma_mm
        Standard deviation of the burr's place across its length, in the camera's frame.
    move
        Number of the arm's move that it was made after: those of one number share its error.

    """

    T_base_burr: Floats
    T_base_flange: Floats
    across_sigma_mm: float
    move: int


def place_now(
    sightings: Sequence[Sighting], *, sheet: PositionerSheet, lever_mm: float
) -> tuple[Floats, float]:
    """Where the burr is over the mill as it stands, by the last look and what those before it add. O(looks³).

    Parameters
    ----------
    sightings
        One or more, from poses near to each other.
    sheet
        Of the arm.
    lever_mm
        From the flange to the mill: its turns act over it.

    Returns
    -------
    pose
        (4, 4) of the burr in the base frame by the arm's word at the last look.
    sigma_mm
        Standard deviation of its place across its length. Where the looks scatter by more than is stated of
        them, it is what their scatter makes it (Birge 1932).

    """
    scatter, drift = _errors_mm(sightings, sheet, lever_mm)
    same = _same(sightings)
    last = same[-1]
    # a look before the last is off by its own move and by the last one, which they all share
    moved = scatter**2 * (same - last[:, None] - last + 1.0) + same * np.outer(drift, drift)
    return _joined(sightings, moved)


def place_to_go(sightings: Sequence[Sighting], *, sheet: PositionerSheet, lever_mm: float) -> Floats:
    """(4, 4) where the arm is to look for the burr next, by its own word; parameters as above. O(looks³).

    The next move scatters as those before it did: the mean of the looks is the better aim, not the last.
    """
    scatter, drift = _errors_mm(sightings, sheet, lever_mm)
    return _joined(sightings, _same(sightings) * (scatter**2 + np.outer(drift, drift)))[0]


def _same(sightings: Sequence[Sighting]) -> Floats:
    """(L, L) 1 for looks after the same move, 0 for others."""
    move = np.array([sighting.move for sighting in sightings])
    return np.asarray(move[:, None] == move, float)


def _joined(sightings: Sequence[Sighting], moved_mm2: Floats) -> tuple[Floats, float]:
    """The best mean in the last look's orientation, which is the nearest; and its sigma.

    Generalised least squares (Aitken 1936) with (L, L) covariances of the moves.
    """
    last = sightings[-1]
    back = np.linalg.inv(last.T_base_burr)
    steps = np.array([(back @ sighting.T_base_burr)[:3, 3] for sighting in sightings])
    own = np.array([sighting.across_sigma_mm for sighting in sightings])
    alike = np.where(np.eye(len(own)) > 0.0, 1.0, _ALIKE * _same(sightings))
    seen = alike * np.outer(own, own) + np.diag((_YAW_RAD * steps[:, 0]) ** 2)
    inverse = np.linalg.inv(seen + moved_mm2)
    weight = inverse.sum(axis=0)
    place = (weight / weight.sum()) @ steps
    off = steps[:, 1] - place[1]
    excess = float(off @ inverse @ off) / max(len(sightings) - 1, 1)
    step = np.eye(4)
    step[:3, 3] = place
    return last.T_base_burr @ step, float(np.sqrt(max(excess, 1.0) / weight.sum()))


def _errors_mm(
    sightings: Sequence[Sighting], sheet: PositionerSheet, lever_mm: float
) -> tuple[float, Floats]:
    """Of the mill along each axis: what a move scatters by, and what the arm drifts by since each look.

    What it is off by comes of its joints' zeros and links and changes by about itself over half of its reach,
    or over a radian (Hollerbach & Wampler 1996): over a short way, by that share. The way is the flange's:
    the mill may stand still while it swings.
    """
    scatter = float(np.hypot(sheet.scatter_mm, np.radians(sheet.scatter_deg) * lever_mm))
    offset = float(np.hypot(sheet.offset_mm, np.radians(sheet.offset_deg) * lever_mm))
    flanges = np.array([sighting.T_base_flange for sighting in sightings])
    way = np.linalg.norm(flanges[:, :3, 3] - flanges[-1, :3, 3], axis=1)
    turn = Rotation.from_matrix(flanges[-1, :3, :3].T @ flanges[:, :3, :3]).magnitude()
    return scatter, np.asarray(offset * np.hypot(way / (0.5 * sheet.reach_mm), turn), float)
