"""The curve that all views share: its pieces, found anew where the poses have moved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from burrscan.arrays import Floats
from burrscan.axis.fitting.fit import BEND, FEWEST, Curve, inverses
from burrscan.axis.fitting.ridges import Pieces, find_pieces
from burrscan.pose import placed
from burrscan.registration.joined.points import Rows
from burrscan.strays import FAR, beyond

_LEAST_SHARE = 0.025
"""Of the mean number of points: a piece with less is a scrap of background."""


def pieces_of(points: Sequence[Floats], poses: Floats, blur_mm: float) -> Pieces:
    """Pieces of the curve that all views' points make at their poses. O(V)."""
    whole = np.concatenate([placed(pose, p) for p, pose in zip(points, poses, strict=True)])
    whole = np.ascontiguousarray(whole[~beyond(whole, times=FAR)])
    r = np.hypot(whole[:, 0], whole[:, 1])
    bounds = np.array([whole[:, 2].min(), whole[:, 2].max(), r.min(), r.max()])
    pieces = find_pieces(whole, np.empty(0), np.eye(3), np.zeros(3), blur=blur_mm, bounds=bounds)
    j, k = (
        np.clip(((value - low) / pieces.cell).astype(int), 0, size - 1)
        for value, low, size in zip((whole[:, 2], r), pieces.origin, pieces.labels.shape, strict=True)
    )
    label = pieces.labels[j, k]
    count = np.bincount(label[label >= 0], minlength=len(pieces.centre))
    poor = count < max(FEWEST, _LEAST_SHARE * count.mean()) if len(count) else np.zeros(0, bool)
    labels = np.where((pieces.labels >= 0) & poor[pieces.labels], -1, pieces.labels).astype(np.int16)
    return replace(pieces, labels=labels)


def curve_at(pieces: Pieces, coefficients: Floats) -> Curve:
    """Pieces and coefficients as kernels take them."""
    return Curve(
        pieces.centre,
        pieces.normal,
        coefficients,
        pieces.labels,
        pieces.origin,
        pieces.cell,
        pieces.spacing,
    )


def inverses_of(rows: Sequence[Rows], spacing_mm: float) -> Floats:
    """(K, 3, 3) inverse of every piece's normal matrix over all views; zero where no view has points."""
    normal = np.sum([row.sums[:, :3, :3] for row in rows], axis=0)
    return inverses(normal, (BEND * spacing_mm) ** -2.0, normal[:, 0, 0] > 0.0)
