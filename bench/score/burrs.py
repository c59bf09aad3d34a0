"""How well burrs were found: hits, false calls, and the errors of those that were found."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from bench.score.evidence import Evidence, PartEvidence
from bench.score.matching import Place
from burrscan.arrays import Bools, Floats
from burrscan.turns import turn_deg

_STEP_MM = 1.0
"""Along a burr, over which a majority of pixels says whether it was measured."""
CERTAIN_DPRIME = 10.0
"""A known signal of this strength, with a threshold midway, is missed once in 3 million."""


def burr_found(evidence: PartEvidence) -> float:
    """Share of the true burrs that were found: within 3 degrees, overlapping along the axis, same side."""
    best = evidence.matching.best
    return sum(piece >= 0 for piece in best) / len(best) if best else math.nan


def burr_located(evidence: PartEvidence) -> float:
    """Share of the true burrs at whose place something is called, whatever its side."""
    located = evidence.matching.located
    return sum(located) / len(located) if located else math.nan


def burr_dprime(evidence: Evidence) -> float:
    """Detectability of the hardest true burr by the frames shown: d' of the ideal observer."""
    return min(evidence.dprimes, default=math.nan)


def side_dprime(evidence: Evidence) -> float:
    """The least d' between a true burr and one of its size on the other side, by the frames shown."""
    return min((d for d in evidence.side_dprimes if not math.isnan(d)), default=math.nan)


def burr_efficiency(evidence: Evidence) -> float:
    """Share of the true burrs with d' above 10 that were located."""
    told = [
        located
        for located, dprime in zip(evidence.matching.located, evidence.dprimes, strict=False)
        if dprime > CERTAIN_DPRIME
    ]
    return sum(told) / len(told) if told else math.nan


def false_calls(evidence: PartEvidence) -> float:
    """Burrs reported where there is none. Pieces of a burr that was found are not false calls."""
    return float(sum(owner < 0 for owner in evidence.matching.match))


def burr_angle_deg(evidence: PartEvidence) -> float:
    """Mean absolute error of the angle of the burrs found."""
    return _mean_over_hits(evidence, angle_error_deg)


def burr_height_mm(evidence: PartEvidence) -> float:
    """Mean absolute error of the height of the burrs found."""
    return _mean_over_hits(evidence, height_error_mm)


def burr_extent_mm(evidence: PartEvidence) -> float:
    """Mean absolute error of the two ends along the axis of the burrs found."""
    return _mean_over_hits(evidence, lambda found, true: sum(map(abs, end_errors_mm(found, true))) / 2.0)


def burr_coverage(evidence: Evidence) -> float:
    """Share of the visible length of the true burrs that was measured.

    A millimetre of length is visible where a pixel sees the burr, and measured where at least half of the
    pixels that see it are right.
    """
    numbers = range(len(evidence.matching.true))
    visible = sum(visible_mm(evidence, number) for number in numbers)
    covered = sum(length_mm(evidence, number, evidence.right) for number in numbers)
    return covered / visible if visible else math.nan


def angle_error_deg(found: Place, true: Place) -> float:
    """Angle found minus true."""
    return turn_deg(found.angle_deg - true.angle_deg)


def height_error_mm(found: Place, true: Place) -> float:
    """Height found minus true."""
    return found.height_mm - true.height_mm


def end_errors_mm(found: Place, true: Place) -> tuple[float, float]:
    """Start and end along the axis, found minus true."""
    return found.z_start_mm - true.z_start_mm, found.z_end_mm - true.z_end_mm


def visible_mm(evidence: Evidence, number: int) -> float:
    """Length of a true burr that the camera sees, in steps of 1 mm; see :func:`length_mm`."""
    return length_mm(evidence, number, np.ones_like(evidence.right))


def length_mm(evidence: Evidence, number: int, good: Bools) -> float:
    """Length of a true burr on which at least half of the pixels that see it are ``good`` (h, w).

    It runs along the axis, or for an arc along the arc, and is counted in steps of 1 mm.
    """
    on_burr = evidence.truth.burr_index == number
    place = evidence.matching.true[number]
    step = np.floor(_along_mm(evidence.truth.points_part_mm[on_burr], place) / _STEP_MM).astype(int)
    _, step = np.unique(step, return_inverse=True)
    majority = np.bincount(step, 2.0 * good[on_burr] - 1.0)
    return _STEP_MM * int(np.count_nonzero(majority >= 0.0))


def burr_tables(evidence: PartEvidence) -> tuple[Mapping[str, Any], ...]:
    """One table per true burr: what it was, how much of it was seen and measured, what was found of it."""
    return tuple(_table(evidence, number, place) for number, place in enumerate(evidence.matching.true))


def _table(evidence: PartEvidence, number: int, true: Place) -> Mapping[str, Any]:
    piece = evidence.matching.best[number]
    burr = evidence.true_burrs[number]
    visible, measurable, covered = _lengths_mm(evidence, number)
    table: dict[str, Any] = {
        "kind": burr.kind,
        "section": burr.section,
        "side": true.side,
        "height_mm": true.height_mm,
        "width_mm": float(burr.width_mm),
        "visible_mm": visible,
        "measurable_mm": measurable,
        "covered_mm": covered,
        "found": piece >= 0,
        "located": evidence.matching.located[number],
    }
    if isinstance(evidence, Evidence) and evidence.dprimes:
        table["dprime"] = evidence.dprimes[number]
    if isinstance(evidence, Evidence) and evidence.side_dprimes and evidence.side_dprimes[number] >= 0.0:
        table["side_dprime"] = evidence.side_dprimes[number]
    return table if piece < 0 else table | _errors(evidence.matching.found[piece], true)


def _lengths_mm(evidence: PartEvidence, number: int) -> tuple[float, float, float]:
    """Visible, measurable and covered length; a synthetic mesh shows and covers all of its burrs."""
    if not isinstance(evidence, Evidence):
        return (evidence.true_burrs[number].length_mm,) * 3
    good = (np.ones_like(evidence.right), evidence.truth.measurable, evidence.right)
    visible, measurable, covered = (length_mm(evidence, number, pixels) for pixels in good)
    return visible, measurable, covered


def _errors(found: Place, true: Place) -> dict[str, float]:
    start, end = end_errors_mm(found, true)
    return {
        "angle_error_deg": angle_error_deg(found, true),
        "height_error_mm": height_error_mm(found, true),
        "start_error_mm": start,
        "end_error_mm": end,
    }


def _mean_over_hits(evidence: PartEvidence, error: Callable[[Place, Place], float]) -> float:
    """Mean amount over the burrs found whose method states the quantity; NaN where it never does."""
    matching = evidence.matching
    errors = [
        abs(error(matching.found[piece], true))
        for piece, true in zip(matching.best, matching.true, strict=True)
        if piece >= 0
    ]
    stated = [value for value in errors if not math.isnan(value)]
    return float(np.mean(stated)) if stated else math.nan


def _along_mm(points_mm: Floats, place: Place) -> Floats:
    """Position along a burr (N,) of part-frame points (N, 3) on it, from its start."""
    if place.arc_deg == 0.0:
        inside = np.clip(points_mm[:, 2], place.z_start_mm, place.z_end_mm - 1e-6)
        return inside - place.z_start_mm
    turns = turn_deg(np.degrees(np.arctan2(points_mm[:, 1], points_mm[:, 0])) - place.angle_deg)
    return np.radians(turns + place.arc_deg) * np.hypot(points_mm[:, 0], points_mm[:, 1])
