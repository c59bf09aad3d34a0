"""How well the light was decoded: coverage, wrong correspondences, depth, clipping, frames."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from bench.score.evidence import Evidence
from burrscan.robust import SIGMA_PER_MEDIAN
from scenes.measurable import LIMIT_PX


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
    return _rms(evidence.depth_error_mm[np.isfinite(evidence.depth_error_mm)])


def u_rms_px(evidence: Evidence) -> float:
    """Root mean square error of the projector column of right pixels, projector pixels."""
    return _rms(evidence.inlier_error_px[np.isfinite(evidence.inlier_error_px)])


def bound_ratio(evidence: Evidence) -> float:
    """Column RMS of right pixels over the RMS of their Cramér-Rao bounds for the frames really shown.

    The bound knows the transport: per pixel, column, direct amplitude and steady light are unknown, the
    interreflected light is known (:mod:`scenes.bound`). All pictures of the scan count, probing included;
    it is computed on every eighth row of the camera.
    """
    return _over_bound(evidence, "known_px", at_most_px=math.inf)


def bound_ratio_second(evidence: Evidence) -> float:
    """As :func:`bound_ratio`, of the bound that does not know a second path's origin and strength.

    Over pixels that this bound lets be known to :data:`scenes.measurable.LIMIT_PX`: where the frames cannot
    tell two paths apart it has no upper end.
    """
    return _over_bound(evidence, "second_path_px", at_most_px=LIMIT_PX)


def _over_bound(
    evidence: Evidence, which: Literal["known_px", "second_path_px"], *, at_most_px: float
) -> float:
    if evidence.bounds is None:
        return math.nan
    bound_px = getattr(evidence.bounds, which)
    both = np.isfinite(evidence.inlier_error_px) & np.isfinite(bound_px) & (bound_px <= at_most_px)
    bound = _rms(bound_px[both].astype(float))
    return _rms(evidence.inlier_error_px[both]) / bound if bound > 0.0 else math.nan


def pull_spread(evidence: Evidence) -> float:
    """Robust standard deviation, 1.4826 times the median size, of error over stated sigma of right pixels.

    1 is honest; above it the stated sigmas are too small, below it too large.
    """
    pulls = np.abs(evidence.inlier_error_px / evidence.outcome.scan.correspondence.sigma_u_px)
    pulls = pulls[np.isfinite(pulls)]
    return SIGMA_PER_MEDIAN * float(np.median(pulls)) if pulls.size else math.nan


def saturated_share(evidence: Evidence) -> float:
    """Share of measurable pixels that were clipped in every exposure of the final sequence."""
    return _share(evidence.outcome.scan.saturated & evidence.truth.measurable, evidence.truth.measurable)


def frames(evidence: Evidence) -> float:
    """Pictures taken in all, probing included."""
    return float(evidence.outcome.scan.frames)


def _rms(errors: np.ndarray) -> float:
    return math.sqrt(float(np.mean(errors**2))) if errors.size else math.nan


def _share(part: np.ndarray, whole: np.ndarray) -> float:
    count = int(np.count_nonzero(whole))
    return int(np.count_nonzero(part)) / count if count else math.nan
