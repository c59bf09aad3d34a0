"""One look: where the scanner was said to be, and what it saw."""

from __future__ import annotations

from dataclasses import dataclass, replace

from burrscan.arrays import Floats, freeze
from burrscan.pipeline import Outcome, Pipeline, Stage


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


def of_several(pipeline: Pipeline | None) -> Pipeline:
    """The pipeline for one of several looks: the default finder leaves what one look cannot tell to them all.

    One look drops what may be a scratch, and with it thin burrs; here other looks confirm or deny it
    (:mod:`burrscan.cell.evidence`), or it is known to be a burr. A finder that is not the default, or that
    is told ``several_views``, is taken as it is.
    """
    pipeline = pipeline or Pipeline()
    burrs = pipeline.burrs
    if burrs.method != Pipeline().burrs.method or "several_views" in burrs.parameters:
        return pipeline
    return replace(pipeline, burrs=Stage(burrs.method, {**burrs.parameters, "several_views": True}))
