"""What a planner must beat: even turns, chance, and set cover by visibility alone."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats
from burrscan.cell.belief import shifted
from burrscan.cell.choices import TURN_DEG
from burrscan.cell.planners.known import Known

_AGAIN = 1e-3
"""Worth of a cell's second look against its first: nothing, but for the order of equals."""


def ring(known: Known) -> list[int]:
    """Even turns of the table with the arm in its first pose.

    As many as there may be looks, each in the middle of the widest gap (van der Corput's order), so that a
    ring which is broken off is as even as it can be.
    """
    turns = round(360.0 / TURN_DEG)
    order = sorted(range(known.most), key=_reversed_bits)
    wanted = [round(turns * place / known.most) % turns for place in order]
    rest = [number for number in range(len(known.choices)) if number not in wanted]
    return [number for number in [*wanted, *rest] if number not in known.taken]


def random(known: Known) -> list[int]:
    """Any of the choices."""
    order = known.rng.permutation(len(known.choices))
    return [int(number) for number in order if number not in known.taken]


def greedy(known: Known) -> list[int]:
    """The choice that shows most of what no look has shown yet, by shape alone.

    Set cover over a visibility matrix (Scott, Roth & Rivest, ACM Computing Surveys 35, 64, 2003); once all
    is covered, cover by a second look, and so on.
    """
    if known.chart is None:
        return list(range(len(known.choices)))
    area = known.chart.area_mm2[:, None]
    looked = np.zeros(known.chart.shape)
    for number in known.taken:
        choice = known.choices[number]
        looked += shifted(known.arms[choice.arm].surface.seen, -choice.cells)
    worth: Floats = area * np.power(_AGAIN, looked)
    value = np.array(
        [
            (worth * shifted(known.arms[choice.arm].surface.seen, -choice.cells)).sum()
            for choice in known.choices
        ]
    )
    value[list(known.taken)] = -np.inf
    return [int(number) for number in np.argsort(-value, kind="stable")]


def _reversed_bits(number: int) -> float:
    """Van der Corput's sequence in base 2."""
    value, share = 0.0, 0.5
    while number:
        value += share * (number & 1)
        number >>= 1
        share *= 0.5
    return value
