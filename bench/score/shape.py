"""How well the surface of revolution was found: its axis and its generatrix."""

from __future__ import annotations

import math

import numpy as np

from bench.score.evidence import Evidence
from bench.score.places import transform
from bench.score.polyline import resample
from scenes.wheel import deviation_mm


def axis_deg(evidence: Evidence) -> float:
    """Angle between the direction of the axis found and the true one; the sign of a direction is void."""
    direction = evidence.T_part_found[:3, 2]
    return math.degrees(math.atan2(math.hypot(direction[0], direction[1]), abs(direction[2])))


def axis_offset_mm(evidence: Evidence) -> float:
    """Distance of the axis found from the middle of the part, the true axis halfway along the generatrix."""
    z = evidence.truth.wheel.generatrix_zr_mm[:, 0]
    middle = np.array([0.0, 0.0, 0.5 * float(np.nanmin(z) + np.nanmax(z))])
    in_found_frame = transform(np.linalg.inv(evidence.T_part_found), middle)
    return math.hypot(in_found_frame[0], in_found_frame[1])


def generatrix_rms_mm(evidence: Evidence) -> float:
    """Root mean square distance from the generatrix found to the true one; every mm weighs alike."""
    found = resample(evidence.generatrix_zr_mm, step_mm=0.1)
    if not len(found):
        return math.nan
    in_part_frame = np.column_stack([found[:, 1], np.zeros(len(found)), found[:, 0]])
    distance = deviation_mm(in_part_frame, evidence.truth.wheel.generatrix_zr_mm)
    return math.sqrt(float(np.mean(distance**2)))


def band_mm(evidence: Evidence) -> float:
    """Median thickness of the band of measured points around the generatrix found (no truth needed)."""
    band = evidence.outcome.inspection.generatrix.band_mm
    return float(np.nanmedian(band)) if np.isfinite(band).any() else math.nan
