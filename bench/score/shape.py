"""How well the surface of revolution was found: its axis and its generatrix."""

from __future__ import annotations

import math

import numpy as np

from bench.score.evidence import PartEvidence
from bench.score.polyline import resample
from burrscan.arrays import Floats
from burrscan.axis.basis import perpendicular_basis
from burrscan.inspection import Axis
from burrscan.pose import placed
from scenes.wheel import deviation_mm

OFF_DEG = 1.0
"""A run that is off by more than this has found another axis (issue 4)."""
Z_95 = 1.96
"""Half-width of a 95 % interval in normal standard deviations."""


def axis_deg(evidence: PartEvidence) -> float:
    """Angle between the direction of the axis found and the true one; the sign of a direction is void."""
    direction = evidence.T_part_found[:3, 2]
    return math.degrees(math.atan2(math.hypot(direction[0], direction[1]), abs(direction[2])))


def axis_off(evidence: PartEvidence) -> float:
    """Whether the axis found is off by more than 1 degree: another axis than the part's."""
    return float(axis_deg(evidence) > OFF_DEG)


def axis_held(evidence: PartEvidence) -> float:
    """Share of the four stated 95 % intervals of the axis (two tilts, two offsets) that hold the truth.

    Over many cases 0.95 is honest. NaN where the method states no uncertainty.
    """
    axis = evidence.inspection.axis
    if not np.isfinite(axis.covariance).all():
        return math.nan
    to_mesh = np.linalg.inv(evidence.T_part_mesh).astype(float)
    error = axis_error(axis, point_mm=to_mesh[:3, 3], direction=to_mesh[:3, 2])
    return float(np.mean(np.abs(error) < Z_95 * np.sqrt(np.diag(axis.covariance))))


def axis_bound_deg(evidence: PartEvidence) -> float:
    """Cramér-Rao bound of the root mean square angle: of the scan alone, whatever the method."""
    if evidence.axis_bound is None:
        return math.nan
    return math.degrees(math.sqrt(evidence.axis_bound[0, 0] + evidence.axis_bound[1, 1]))


def axis_error(axis: Axis, *, point_mm: Floats, direction: Floats) -> Floats:
    """(4,) truth minus estimate in the parameters of ``Axis.covariance``: tilts in rad, offsets in mm."""
    basis = perpendicular_basis(axis.direction)
    truth = direction * np.sign(direction @ axis.direction)
    along = (axis.point_mm - point_mm) @ axis.direction / (truth @ axis.direction)
    offset = point_mm + truth * along - axis.point_mm
    return np.concatenate([basis.T @ np.cross(axis.direction, truth), basis.T @ offset])


def axis_offset_mm(evidence: PartEvidence) -> float:
    """Distance of the axis found from the middle of the part, the true axis halfway along the generatrix."""
    z = evidence.true_generatrix_zr_mm[:, 0]
    middle = np.array([0.0, 0.0, 0.5 * float(np.nanmin(z) + np.nanmax(z))])
    in_found_frame = placed(np.linalg.inv(evidence.T_part_found), middle)
    return math.hypot(in_found_frame[0], in_found_frame[1])


def generatrix_rms_mm(evidence: PartEvidence) -> float:
    """Root mean square distance from the generatrix found to the true one; every mm weighs alike."""
    found = resample(evidence.generatrix_zr_mm, step_mm=0.1)
    if not len(found):
        return math.nan
    in_part_frame = np.column_stack([found[:, 1], np.zeros(len(found)), found[:, 0]])
    distance = deviation_mm(in_part_frame, evidence.true_generatrix_zr_mm)
    return math.sqrt(float(np.mean(distance**2)))


def band_mm(evidence: PartEvidence) -> float:
    """Median thickness of the band of measured points around the generatrix found (no truth needed)."""
    band = evidence.inspection.generatrix.band_mm
    return float(np.nanmedian(band)) if np.isfinite(band).any() else math.nan
