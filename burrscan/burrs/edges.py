"""Burrs that stand on an edge of the part and run along it."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats, Ints
from burrscan.burrs.field import Field

SHARP = np.cos(np.radians(20.0))
"""Within a burr's height along the curve the normal turns by more in a corner."""
_MOST = 0.5
"""Share of a burr's vertices that are on the edge: most of them."""
_HIGH = 0.9
"""Quantile of its vertices' deviations that is how high an anomaly is, about."""


def on_edge(field: Field, on: Ints, sign: int, *, within_mm: float = 0.0) -> bool:
    """Whether what stands off is on a convex edge of the generatrix, or near one. O(M + N).

    Parameters
    ----------
    field
        All vertices.
    on
        (M,) those of the anomaly.
    sign
        +1 for material too much; what is missing from an edge is seen beside it.
    within_mm
        How far from the edge it may be, along the curve; as far as it is high at least.

    """
    if sign < 0 or not len(on):
        return False
    along, around = field.along_mm[on], field.arc_mm(on)
    if np.ptp(around) < np.ptp(along):
        return False
    high = max(float(np.quantile(field.deviation_mm[on], _HIGH)), within_mm)
    near = np.flatnonzero(np.abs(field.along_mm - np.median(along)) < np.ptp(along) + 2.0 * high)
    before, after = normals_at(field, near, along - high, along + high)
    turned = (before * after).sum(axis=1) < SHARP
    convex = before[:, 0] * after[:, 1] < before[:, 1] * after[:, 0]
    return bool(np.count_nonzero(turned & convex) > _MOST * len(on))


def normals_at(field: Field, among: Ints, *along_mm: Floats) -> list[Floats]:
    """Normals (z, r) of the next of some vertices at places along the curve, (M, 2) for each (M,) asked."""
    order = among[np.argsort(field.along_mm[among], kind="stable")]
    ends = (np.searchsorted(field.along_mm[order], places) for places in along_mm)
    return [field.normal[order[np.minimum(end, len(order) - 1)]] for end in ends]
