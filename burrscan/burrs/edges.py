"""Burrs that stand on an edge of the part and run along it."""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np

from burrscan.arrays import Bools, Floats, Ints
from burrscan.burrs.field import Field
from burrscan.generatrix.polyline import Polyline, turned
from burrscan.generatrix.ray import first_met

SHARP = np.cos(np.radians(20.0))
"""Within a burr's height along the curve the normal turns by more in a corner."""
_MOST = 0.5
"""Share of a burr's vertices that are on the edge: most of them."""
_HIGH = 0.9
"""Quantile of its vertices' deviations that is how high an anomaly is, about."""


class View(NamedTuple):
    """The fitted wheel, and where camera and projector stand, (2, 3) mm, part frame."""

    line: Polyline
    at_mm: Floats


def on_edge(
    field: Field, on: Ints, sign: int, *, within_mm: float = 0.0, ends_in: View | None = None
) -> bool:
    """Whether what stands off is on a convex edge of the generatrix, or near one. O(M · segments + N).

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
    ends_in
        Of one view where the curve ends is an edge, too: a face beyond it that rose from it would hide it
        from where that face is not seen. It is none where another part of the wheel hides what is beyond, as
        a hub does a flange's root. None where only edges that are seen count.

    """
    if sign < 0 or not len(on):
        return False
    along, around = field.along_mm[on], field.arc_mm(on)
    if np.ptp(around) < np.ptp(along):
        return False
    high = max(float(np.quantile(field.deviation_mm[on], _HIGH)), within_mm)
    near = np.flatnonzero(np.abs(field.along_mm - np.median(along)) < np.ptp(along) + 2.0 * high)
    before, after = normals_at(field, near, along - high, along + high)
    sharp = (before * after).sum(axis=1) < SHARP
    convex = before[:, 0] * after[:, 1] < before[:, 1] * after[:, 0]
    edge = sharp & convex
    if ends_in is not None:
        for step_mm in (-high, high):
            ends = at_end(field, along + step_mm)
            edge[ends] |= ~_hidden(field, on[ends], step_mm, ends_in)
    return bool(np.count_nonzero(edge) > _MOST * len(on))


def _hidden(field: Field, on: Ints, step_mm: float, view: View) -> Bools:
    """(M,) True where the wheel stands before what is up to two steps further along a straight curve.

    One step is not enough where a wall leans over its root, so that both are seen beside the root.
    """
    z, r = field.normal[on].T
    along = step_mm * np.stack([r, -z], axis=1)
    beyond = [turned(field.foot[on] + steps * along, field.angle[on]) for steps in (1.0, 2.0)]
    hidden = np.zeros(len(on), bool)
    for place, at in product(beyond, view.at_mm):
        ray = place - at
        met, _ = first_met(view.line, np.broadcast_to(at, ray.shape), ray, beyond_mm=0.0)
        hidden |= (1.0 - met) * np.linalg.norm(ray, axis=1) > abs(step_mm)
    return hidden


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
