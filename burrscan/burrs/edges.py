"""Burrs that stand on an edge of the part and run along it."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Bools, Floats, Ints
from burrscan.burrs.field import Field

SHARP = np.cos(np.radians(20.0))
"""Within a burr's height along the curve the normal turns by more in a corner."""
_MOST = 0.5
"""Share of a burr's vertices that are on the edge: most of them."""
_HIGH = 0.9
"""Quantile of its vertices' deviations that is how high an anomaly is, about."""


def on_edge(field: Field, on: Ints, sign: int, *, within_mm: float = 0.0, ends: bool = False) -> bool:
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
    ends
        Whether where the curve ends is an edge: of one view it is. A face beyond it that rose from it would
        hide it from where that face is not seen.

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
    edge = turned & convex
    if ends:
        edge |= at_end(field, along - high) | at_end(field, along + high)
    return bool(np.count_nonzero(edge) > _MOST * len(on))


def at_end(field: Field, along_mm: Floats) -> Bools:
    """(M,) True for places along the curve that nothing is nearest to."""
    row = np.floor(along_mm / field.step_mm).astype(np.int64)
    seen = np.append(field.count.any(axis=1), False)  # the last for what is beyond either end
    return ~seen[np.where((row >= 0) & (row < len(field.count)), row, -1)]


def normals_at(field: Field, among: Ints, *along_mm: Floats) -> list[Floats]:
    """Normals (z, r) of the next of some vertices at places along the curve, (M, 2) for each (M,) asked."""
    order = among[np.argsort(field.along_mm[among], kind="stable")]
    ends = (np.searchsorted(field.along_mm[order], places) for places in along_mm)
    return [field.normal[order[np.minimum(end, len(order) - 1)]] for end in ends]
