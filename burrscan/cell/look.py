"""One look: where the scanner was said to be, and what it saw."""

from __future__ import annotations

from dataclasses import dataclass

from burrscan.arrays import Floats, freeze
from burrscan.pipeline import Outcome


@dataclass(frozen=True)
class Look:
    """One look of a cell.

    Parameters
    ----------
    choice
        Its number among the choices.
    T_plate_camera
        (4, 4) the camera over the plate, as reported.
    outcome
        The scan and its inspection; None where the view shows no surface of revolution.
    why
        What the pipeline said then.

    """

    choice: int
    T_plate_camera: Floats
    outcome: Outcome | None
    why: str = ""

    def __post_init__(self) -> None:
        freeze(self, T_plate_camera=self.T_plate_camera)
