"""Stated standard deviations against what the data show."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats

_SHARE, _GAUSSIAN = 0.8, 1.2816
"""Burrs are less than a fifth of a class; a Gaussian's amount stays below 1.28 sigma so often."""
_FEWEST = 300
"""Vertices: a quantile of 80 % of so many is known to 5 %; smaller octaves join the noisier one."""


def calibrated(stated: Floats, deviation: Floats) -> Floats:
    """(N,) stated sigmas, raised to what vertices of about the same sigma deviate by.

    A scanner's sigmas know photons and patterns; where the light was bad they are large, but the errors (of
    bounced light, above all) are larger still. O(N).
    """
    if not (stated > 0.0).all():
        return stated
    return np.asarray(stated * _excess(stated, np.abs(deviation) / (_GAUSSIAN * stated)))


def _excess(noise: Floats, size: Floats) -> Floats:
    """(N,) factor, at least 1, by which the 80 % point of ``size`` (N,) exceeds 1 among values of like noise.

    One factor per octave of ``noise`` (N,); an octave with few values is judged together with those above.
    """
    octave = np.round(np.log2(noise / np.median(noise))).astype(np.int64)
    octave -= octave.min()
    factor = np.ones(int(octave.max()) + 1)
    above = np.empty(0, dtype=np.int64)
    start = len(factor)
    for k in range(len(factor))[::-1]:
        above = np.append(np.flatnonzero(octave == k), above)
        if len(above) >= _FEWEST:
            factor[k:start] = max(float(np.quantile(size[above], _SHARE)), 1.0)
            start, above = k, above[:0]
    return factor[octave]
