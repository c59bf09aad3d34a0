"""How high an anomaly's crest is, read off its vertices: the fitted cross-section must not be lower.

A burr narrower than a few vertices is mostly halo: a cross-section fitted to all of it by least squares is
wide and low, though the vertices on its crest are measured. And a height that varies along the burr has a
largest value, which no even ridge shows.
"""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats, Ints
from burrscan.burrs.field import Field
from burrscan.burrs.height import with_height
from burrscan.inspection import Burr, Value

_LARGEST = 0.9
"""The largest height is this quantile of the crest's: the very highest of many is noise."""
_CONTRADICTS = 3.0
"""Standard deviations by which the crest must exceed the fit before it is believed instead."""
_FEWEST = 3
"""Stretches that a crest is read off."""


def no_lower_than_its_crest(burr: Burr, field: Field, vertices: Ints) -> Burr:
    """The burr with the height of its crest, where that contradicts the height fitted.

    Parameters
    ----------
    burr
        As described by its cross-section.
    field, vertices
        (M,) vertices of the field on it.

    Notes
    -----
    The crest is the highest vertex of each stretch of one spacing along the longer side of the burr. Its
    sigma is the vertices', and half of what the crest varies by. Area and volume follow the height.
    O(M log M).

    """
    lift = field.deviation_mm[vertices] * (1.0 if burr.side == "protrusion" else -1.0)
    along, around = field.along_mm[vertices], field.arc_mm(vertices)
    crest = _crest(lift, along / field.spacing_mm, around / field.spacing_mm)
    if len(crest) < _FEWEST:
        return burr
    tall, usual = float(np.quantile(lift[crest], _LARGEST)), float(np.median(lift[crest]))
    noise = float(np.median(field.sigma_mm[vertices][crest]))
    fitted = burr.height_mm
    if tall - fitted.value <= _CONTRADICTS * float(np.hypot(fitted.sigma, noise)):
        return burr
    height = Value(tall, float(np.hypot(noise, 0.5 * (tall - usual))))
    return with_height(burr, height, share=height.sigma / tall)


def _crest(lift: Floats, along: Floats, around: Floats) -> Ints:
    """Numbers of the highest vertex in each stretch of the longer side."""
    stretch = [np.floor(place).astype(np.int64) for place in (along, around)]
    longer = max(stretch, key=lambda one: len(np.unique(one)))
    order = np.lexsort((lift, longer))
    last = np.append(np.diff(longer[order]) != 0, True)
    crest: Ints = order[last]
    return crest
