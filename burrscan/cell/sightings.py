"""A burr's place over the mill from several looks.

The last one measures it; those before it help by as much as the arm's moves since are known.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from burrscan.arrays import Floats
from burrscan.cell.positioner import PositionerSheet

_YAW_RAD = np.radians(1.0)
"""How well the burr's direction on the surface is known: a look that finds its middle elsewhere along its
length sees another place of its line."""


class Sighting(NamedTuple):
    """A burr in one look.

    Parameters
    ----------
    T_base_burr, T_base_tool
        (4, 4) the burr by this look, and the mill, both by the arm's word.
    across_sigma_mm
        Standard deviation of the burr's place across its length, in the camera's frame.

    """

    T_base_burr: Floats
    T_base_tool: Floats
    across_sigma_mm: float


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
    before = np.append(np.ones(len(sightings) - 1), 0.0)
    # a look before the last is off by its own move and by the last one, which they all share
    moved = scatter**2 * (np.diag(before) + np.outer(before, before)) + np.diag((before * drift) ** 2)
    return _joined(sightings, moved)


def place_to_go(sightings: Sequence[Sighting], *, sheet: PositionerSheet, lever_mm: float) -> Floats:
    """(4, 4) where the arm is to look for the burr next, by its own word; parameters as above. O(looks³).

    The next move scatters as those before it did: the mean of the looks is the better aim, not the last.
    """
    scatter, drift = _errors_mm(sightings, sheet, lever_mm)
    return _joined(sightings, np.diag(scatter**2 + drift**2))[0]


def _joined(sightings: Sequence[Sighting], moved_mm2: Floats) -> tuple[Floats, float]:
    """The best mean in the last look's orientation, which is the nearest; and its sigma.

    Generalised least squares (Aitken 1936) with (L, L) covariances of the moves.
    """
    last = sightings[-1]
    back = np.linalg.inv(last.T_base_burr)
    steps = np.array([(back @ sighting.T_base_burr)[:3, 3] for sighting in sightings])
    own = np.array([sighting.across_sigma_mm for sighting in sightings])
    inverse = np.linalg.inv(np.diag(own**2 + (_YAW_RAD * steps[:, 0]) ** 2) + moved_mm2)
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

    What it is off by comes of its joints' zeros and links and changes by about itself over half of its reach
    (Hollerbach & Wampler 1996): over a short way, by that share.
    """
    scatter = float(np.hypot(sheet.scatter_mm, np.radians(sheet.scatter_deg) * lever_mm))
    offset = float(np.hypot(sheet.offset_mm, np.radians(sheet.offset_deg) * lever_mm))
    places = np.array([sighting.T_base_tool[:3, 3] for sighting in sightings])
    way = np.linalg.norm(places - places[-1], axis=1)
    return scatter, np.asarray(offset * way / (0.5 * sheet.reach_mm), float)
