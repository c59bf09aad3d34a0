"""How well the light was decoded: coverage, wrong correspondences, depth, clipping, frames."""

from __future__ import annotations

import math

import numpy as np

from bench.score.evidence import Evidence


def coverage(evidence: Evidence) -> float:
    """Share of measurable pixels that are accepted and within 1 px of the true projector column.

    Measurable: light of the permitted intensity could, at best, measure the pixel to 0.5 px.
    """
    return _share(evidence.right & evidence.truth.measurable, evidence.truth.measurable)


def wrong_rate(evidence: Evidence) -> float:
    """Share of accepted pixels more than 1 px from the true projector column.

    The truth is weighted by the pixel's response. Accepted pixels that no direct light reaches are wrong.
    """
    return _share(evidence.accepted & ~evidence.right, evidence.accepted)


def depth_rms_mm(evidence: Evidence) -> float:
    """Root mean square depth error of inliers: pixels that are right for their footprint and their centre."""
    errors = evidence.depth_error_mm[np.isfinite(evidence.depth_error_mm)]
    return math.sqrt(float(np.mean(errors**2))) if errors.size else math.nan


def saturated_share(evidence: Evidence) -> float:
    """Share of measurable pixels that were clipped in every exposure of the final sequence."""
    return _share(evidence.outcome.scan.saturated & evidence.truth.measurable, evidence.truth.measurable)


def frames(evidence: Evidence) -> float:
    """Pictures taken in all, probing included."""
    return float(evidence.outcome.scan.frames)


def _share(part: np.ndarray, whole: np.ndarray) -> float:
    count = int(np.count_nonzero(whole))
    return int(np.count_nonzero(part)) / count if count else math.nan
