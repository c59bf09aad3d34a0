"""What a cell did, beside the truth, and the metrics of it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from bench.score.part import MeshEvidence


@dataclass(frozen=True)
class LookScore:
    """After each look.

    Parameters
    ----------
    turn_deg, elevation_deg, roll_deg
        Where the scanner stood: turn of the table, height over it, turn about its axis.
    coverage
        Share of the known part that was measured.
    left
        Stated probability that a burr is left.
    found
        Share of the true burrs found.
    false_calls
        Calls that are no burr.
    axis_deg
        Error of the axis from all looks so far, in the first look's frame.
    single_deg
        And from this look alone, in its own.
    joined_deg
        And in this look's own frame what all the looks of the run say of it in the end; NaN for a look that
        found no surface of revolution.

    """

    turn_deg: float
    elevation_deg: float
    roll_deg: float
    coverage: float
    left: float
    found: float
    false_calls: float
    axis_deg: float
    single_deg: float
    joined_deg: float = math.nan


@dataclass(frozen=True)
class RemovalScore:
    """One burr that was to be taken off.

    Parameters
    ----------
    burr
        Its number among the true ones, -1 for a call that is none.
    looks
        Of the servo.
    converged, why
        As the servo said.
    off_mm
        Where the mill truly was, from its place across the burr and along its normal: the larger of the two.
    covered
        Share of its length that the path reaches.
    residual_mm, gouge_mm
        What is truly left of it, and truly cut of the part; NaN where nothing was milled.
    said_residual_mm, said_gouge_mm
        As the look afterwards measured them.

    """

    burr: int
    looks: int
    converged: bool
    why: str
    off_mm: float
    covered: float = math.nan
    residual_mm: float = math.nan
    gouge_mm: float = math.nan
    said_residual_mm: float = math.nan
    said_gouge_mm: float = math.nan


@dataclass(frozen=True)
class CellEvidence(MeshEvidence):
    """What a cell made of a part; its mesh frame is the plate's, as the looks settled it."""

    looks: tuple[LookScore, ...] = ()
    removals: tuple[RemovalScore, ...] = field(default=())
    most: int = 8


def looks(evidence: CellEvidence) -> float:
    """Looks that were made before the stop rule, or the limit, ended them."""
    return float(len(evidence.looks))


def part_coverage(evidence: CellEvidence) -> float:
    """Share of the known part's area that was measured in the end."""
    return evidence.looks[-1].coverage


def burr_left(evidence: CellEvidence) -> float:
    """Stated probability in the end that a burr is left where it could be seen."""
    return evidence.looks[-1].left


def found_by_look(evidence: CellEvidence) -> float:
    """Share of the true burrs found, averaged over the number of looks: the area under that curve.

    After the last look made the share stays as it is.
    """
    found = [look.found for look in evidence.looks]
    whole = found + found[-1:] * (evidence.most - len(found))
    return float(np.mean(whole))


def axis_gain(evidence: CellEvidence) -> float:
    """Error of the axis from all looks over that of the luckiest single one, both in the latter's frame.

    Below 1 where joining helps. In another look's frame the arm's part in where that one stood would count.
    """
    best = min(evidence.looks, key=lambda look: look.single_deg)
    return best.joined_deg / best.single_deg if best.single_deg > 0.0 else math.nan


def servo_converged(evidence: CellEvidence) -> float:
    """Share of the servos to a true burr that ended with mill and burr in agreement."""
    return _mean(evidence, lambda one: float(one.converged))


def servo_looks(evidence: CellEvidence) -> float:
    """Looks of the longest servo."""
    return max((float(one.looks) for one in _true(evidence)), default=math.nan)


def servo_mm(evidence: CellEvidence) -> float:
    """Largest true distance of the mill from its place over the burr, of servos that said they converged."""
    return max((one.off_mm for one in _true(evidence) if one.converged), default=math.nan)


def residual_mm(evidence: CellEvidence) -> float:
    """Largest height that is left of a burr that was milled."""
    return _largest([one.residual_mm for one in _true(evidence)])


def gouge_mm(evidence: CellEvidence) -> float:
    """Largest depth that a mill cut under the ideal surface."""
    return _largest([one.gouge_mm for one in evidence.removals])


def verified_mm(evidence: CellEvidence) -> float:
    """Largest difference between what is left of a burr and what the look afterwards says of it."""
    return _largest([abs(one.residual_mm - one.said_residual_mm) for one in _true(evidence)])


def _true(evidence: CellEvidence) -> list[RemovalScore]:
    return [one for one in evidence.removals if one.burr >= 0]


def _mean(evidence: CellEvidence, of: Callable[[RemovalScore], float]) -> float:
    values = [of(one) for one in _true(evidence)]
    return float(np.mean(values)) if values else math.nan


def _largest(values: list[float]) -> float:
    known = [value for value in values if math.isfinite(value)]
    return max(known, default=math.nan)
