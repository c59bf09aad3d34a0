"""Burrs from the residual field around the generatrix: any number, any direction, both signs."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Bools, Floats, Ints, Ints32
from burrscan.burrs.contrast import boxed, convincing
from burrscan.burrs.describe import Site, describe
from burrscan.burrs.detect import Region, regions
from burrscan.burrs.field import Field, field_of
from burrscan.inspection import Axis, Burr, Generatrix

_MARGIN = 4
"""Cells around a region that its ridge is fitted with."""


def burrs_residual(
    vertices_mm: Floats,
    faces: Ints32,
    axis: Axis,
    generatrix: Generatrix,
    *,
    sigma_mm: Floats | float | None = None,
    limit_mm: float | None = None,
    false_calls_per_wheel: float = 1e-6,
) -> tuple[Burr, ...]:
    """Find every anomaly that noise would not show.

    Parameters
    ----------
    vertices_mm, faces
        (V, 3) and (T, 3) mesh.
    axis, generatrix
        The ideal surface.
    sigma_mm
        Stated standard deviation of the vertices, one or (V,): a lower bound; the data's own spread, which is
        measured locally, may be larger.
    limit_mm
        Largest permitted height (ISO 13715); each burr then says whether it is within.
    false_calls_per_wheel
        How many false burrs Gaussian noise may cause on a wheel without any, on average. The default leaves
        room for the heavier tails of real scans.

    Returns
    -------
    tuple of Burr
        Most significant first.

    Notes
    -----
    O(V). Detection: :mod:`burrscan.burrs.detect`; measure: :mod:`burrscan.burrs.ridge`.

    """
    field = field_of(vertices_mm, faces, axis, generatrix, sigma_mm=sigma_mm)
    found = convincing(field, regions(field, false_calls_per_wheel=false_calls_per_wheel))
    taken = np.zeros(field.count.shape, dtype=np.bool_)
    for region in found:
        taken |= region.cells
    burrs = (describe(field, _site(field, region, taken), axis, limit_mm=limit_mm) for region in found)
    return tuple(burr for burr in burrs if burr is not None)


def _site(field: Field, region: Region, taken: Bools) -> Site:
    chosen = _around(field, region, taken)
    on = region.cells[field.cell[chosen, 0], field.cell[chosen, 1]]
    return Site(chosen, on, region.sign, region.significance, region.inflation)


def _around(field: Field, region: Region, taken: Bools) -> Ints:
    """Vertices in the region's bounding box and a margin, without those of other regions."""
    near = boxed(region.cells, _MARGIN, _MARGIN, closed=field.closed) & ~(taken & ~region.cells)
    return np.flatnonzero(near[field.cell[:, 0], field.cell[:, 1]])
