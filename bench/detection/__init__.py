"""Probability of detection: how large a burr must be to be found, and how sure that is.

After MIL-HDBK-1823A, ASTM E2862 (hit/miss) and ASTM E3023 (signal response). README.md says which model and
which interval is which.
"""

from bench.detection.curve import PodCurve, Share
from bench.detection.hit_miss import fit_hit_miss
from bench.detection.records import Detection, detection, detections, of_one_size, sections
from bench.detection.signal import fit_signal

__all__ = [
    "Detection", "PodCurve", "Share", "detection", "detections", "fit_hit_miss", "fit_signal",
    "of_one_size", "sections",
]  # fmt: skip
