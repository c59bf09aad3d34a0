"""What a planner is told."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from burrscan.cell.belief import Belief
from burrscan.cell.chart import Chart
from burrscan.cell.choices import Arm, Choice
from burrscan.cell.station import Station


@dataclass(frozen=True)
class Known:
    """Everything known when the next look is chosen.

    Parameters
    ----------
    station
        The cell.
    choices
        Where the scanner may stand.
    taken
        The looks so far, by their number among the choices.
    most
        Looks that there may be in all.
    burrs
        Expected number on a part.
    rng
        For planners that draw.
    chart, belief, arms
        The part, what may be left on it, and what each pose of the arm would show; None before the first
        look.

    """

    station: Station
    choices: tuple[Choice, ...]
    taken: tuple[int, ...]
    most: int
    burrs: float
    rng: np.random.Generator
    chart: Chart | None = None
    belief: Belief | None = None
    arms: tuple[Arm, ...] = ()
