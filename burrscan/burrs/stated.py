"""Stated standard deviations against what the data show."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats

_SHARE, _GAUSSIAN = 0.8, 1.2816
"""Burrs are less than a fifth of a class; a Gaussian's amount stays below 1.28 sigma so often."""
_FEWEST = 300


def calibrated(stated: Floats, deviation: Floats) -> Floats:
    """(N,) stated sigmas, raised to what vertices of about the same sigma deviate by.

    A scanner's sigmas know photons and patterns; where the light was bad they are large, but the errors (of
    bounced light, above all) are larger still. One factor of at least 1 per octave of the sigma; an octave of
    few vertices is judged together with those above. O(N).
    """
    if not (stated > 0.0).all():
        return stated
    octave = np.round(np.log2(stated / np.median(stated))).astype(np.int64)
    octave -= octave.min()
    ratio = np.abs(deviation) / stated
    factor = np.ones(int(octave.max()) + 1)
    above = np.empty(0, dtype=np.int64)
    for k in range(len(factor))[::-1]:
        above = np.append(np.flatnonzero(octave == k), above)
        if len(above) >= _FEWEST:
            factor[k:][factor[k:] == 1.0] = max(float(np.quantile(ratio[above], _SHARE)) / _GAUSSIAN, 1.0)
            above = above[:0]
    return np.asarray(stated * factor[octave])
