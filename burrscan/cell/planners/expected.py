"""The look that is expected to find most per second (Stone, Theory of Optimal Search, 1975)."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Bools, Floats
from burrscan.cell.belief import SURE, Belief, shifted
from burrscan.cell.choices import Arm
from burrscan.cell.planners.known import Known
from burrscan.cell.positioner import seconds
from burrscan.cell.station import turned

LOOK_S = 12.0
"""Of a look itself: 60 frames at about 15 a second, and as long again, twice, to make a surface of them and
inspect it (docs/speed.md); beside that a turn of the table costs little."""
_ASIDE = 0.84, 0.5
"""Share of a find that a call from aside is, with the baseline along the burr and across it: two thirds of
the former are clear enough to need no other look (they exceed the least significance by 8, burrs do by 20 in
the mean: the odds of :mod:`burrscan.cell.evidence`); all others take another, which is half of the find."""


def expected(known: Known) -> list[int]:
    """Numbers of the choices, best first.

    What a look is worth is the number of burrs that it would show for the first time: over cells and the two
    ways in which a burr may lie, how many there may be times what is left times the probability that the cell
    is in sight, answers (learnt by the tilt of its normal from the looks so far), and is found; half of that
    where it is seen from aside, for one such look calls no burr. A suspicious place counts in the same
    currency, where a look faces it and one of its flanks answers; so does a burr seen from aside only.
    O(choices × cells).
    """
    if known.belief is None or known.chart is None:
        return list(range(len(known.choices)))
    chart, belief = known.chart, known.belief
    rate = belief.rate(chart, burrs=known.burrs)
    area = rate * chart.area_mm2[:, None] / float(chart.area_mm2.sum() * chart.shape[1])
    ways = belief.lines[:, None, None]
    worth = [ways * area * _finds(arm, belief) for arm in known.arms]
    proof = [_shows_flank(arm, belief) for arm in known.arms]
    faces = [_faces(arm, belief) for arm in known.arms]
    now = _poses(known, known.taken[-1])
    value = np.empty(len(known.choices))
    for number, choice in enumerate(known.choices):
        gain = (shifted(worth[choice.arm], -choice.cells) * belief.hidden).sum()
        gain += (shifted(proof[choice.arm], -choice.cells) * belief.suspicion).sum()
        gain += (shifted(faces[choice.arm], -choice.cells) * belief.unfaced).sum()
        value[number] = gain / (LOOK_S + _seconds(known, now, _poses(known, number)))
    value[list(known.taken)] = -np.inf
    return [int(number) for number in np.argsort(-value, kind="stable")]


def _finds(arm: Arm, belief: Belief) -> Floats:
    """(2, S, around) share of a find that a look is expected to make of what lies in a cell."""
    calls = SURE * belief.answer(arm.surface.tilt_deg) * arm.surface.shows
    worth = np.where(arm.surface.along, *_ASIDE)
    return np.where(arm.surface.seen, calls * np.where(arm.surface.faces, 1.0, worth), 0.0)


def _shows_flank(arm: Arm, belief: Belief) -> Floats:
    """(2, S, around) probability that a flank of what stands in a cell, seen from in front, answers."""
    dark = [np.where(flank.seen, 1.0 - belief.answer(flank.tilt_deg), 1.0) for flank in arm.flanks]
    return np.where(_faced(arm), 1.0 - dark[0] * dark[1], 0.0)


def _faces(arm: Arm, belief: Belief) -> Floats:
    """(2, S, around) probability that a look measures a cell from in front."""
    return np.where(_faced(arm), _finds(arm, belief), 0.0)


def _faced(arm: Arm) -> Bools:
    """(2, S, around) whether a look has a cell in sight and faces a burr there, by the burr's line."""
    return np.asarray(arm.surface.seen & arm.surface.faces)


def _poses(known: Known, number: int) -> tuple[Floats, Floats]:
    """The table's pose and the camera's."""
    station, choice = known.station, known.choices[number]
    return turned(station.T_base_plate, choice.turn_deg), known.arms[choice.arm].T_base_camera


def _seconds(known: Known, here: tuple[Floats, Floats], there: tuple[Floats, Floats]) -> float:
    station = known.station
    return max(seconds(station.table.sheet, here[0], there[0]), seconds(station.arm.sheet, here[1], there[1]))
