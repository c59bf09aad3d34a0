"""One mesh of all views."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Floats, Ints32, freeze
from burrscan.pose import placed
from burrscan.registration.alignment import Alignment, PosedSurface


@dataclass(frozen=True)
class Merged:
    """All views in the world frame.

    Parameters
    ----------
    vertices_mm, faces
        (V, 3) and (T, 3): the views one after the other. Where views overlap, so do their faces: both saw it.
    sigma_mm
        (V,) standard deviation of the vertices.
    view
        (V,) which view a vertex comes from.

    """

    vertices_mm: Floats
    faces: Ints32
    sigma_mm: Floats
    view: Ints32

    def __post_init__(self) -> None:
        freeze(self, vertices_mm=self.vertices_mm, faces=self.faces, sigma_mm=self.sigma_mm, view=self.view)


def merge(views: Sequence[PosedSurface], alignment: Alignment) -> Merged:
    """Lay the views together by their aligned poses. O(V).

    Where a view states no standard deviation, its vertices have that of its points as the alignment saw them.
    """
    counts = [len(view.vertices_mm) for view in views]
    starts = np.cumsum([0, *counts[:-1]])
    points = [placed(p, v.vertices_mm) for p, v in zip(alignment.T_world_camera, views, strict=True)]
    faces = [view.faces + start for view, start in zip(views, starts, strict=True)]
    return Merged(
        vertices_mm=np.concatenate(points),
        faces=np.concatenate(faces).astype(np.int32),
        sigma_mm=np.concatenate([_sigma(view, n, alignment) for n, view in enumerate(views)]),
        view=np.repeat(np.arange(len(views), dtype=np.int32), counts),
    )


def _sigma(view: PosedSurface, number: int, alignment: Alignment) -> Floats:
    if not len(alignment.noise_mm):
        return view.sigma_mm
    return np.where(np.isfinite(view.sigma_mm), view.sigma_mm, alignment.noise_mm[number])
