"""Curves in the (z, r) half-plane."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats


def resample(curve_zr_mm: Floats, step_mm: float) -> Floats:
    """Points (N, 2) at most ``step_mm`` apart along every segment of a curve (K, 2), ends included.

    A NaN row separates pieces; segments that touch one are left out. O(length / step).
    """
    starts, ends = curve_zr_mm[:-1], curve_zr_mm[1:]
    whole = np.isfinite(starts).all(axis=1) & np.isfinite(ends).all(axis=1)
    pieces = [_segment(a, b, step_mm) for a, b in zip(starts[whole], ends[whole], strict=True)]
    return np.concatenate(pieces) if pieces else np.empty((0, 2))


def _segment(start: Floats, end: Floats, step_mm: float) -> Floats:
    steps = max(int(np.ceil(np.linalg.norm(end - start) / step_mm)), 1)
    return start + (end - start) * np.linspace(0.0, 1.0, steps + 1)[:, None]
