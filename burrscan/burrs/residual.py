"""Burrs from the residual field around the generatrix: any number, any direction, both signs."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Bools, Floats, Ints, Ints32
from burrscan.burrs.contrast import boxed, convincing
from burrscan.burrs.describe import Site, describe
from burrscan.burrs.detect import Region, regions, threshold
from burrscan.burrs.field import Field, field_of
from burrscan.burrs.shared import Doubt, doubt_of, noise_around
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
    found = regions(field, false_calls_per_wheel=false_calls_per_wheel)
    if not found:
        return ()
    least = threshold(int((field.count > 0).sum()), false_calls_per_wheel=false_calls_per_wheel)
    measured = _measured(field, convincing(field, found), axis, limit_mm)
    doubt = doubt_of(field)
    return tuple(burr for burr, site in measured if _certain(field, doubt, site, burr) > least)


def _measured(
    field: Field, found: list[Region], axis: Axis, limit_mm: float | None
) -> list[tuple[Burr, Site]]:
    """Every region's measure, of those that have one."""
    taken = np.zeros(field.count.shape, dtype=np.bool_)
    for region in found:
        taken |= region.cells
    sites = [_site(field, region, taken) for region in found]
    burrs = [describe(field, site, axis, limit_mm=limit_mm) for site in sites]
    return [(burr, site) for burr, site in zip(burrs, sites, strict=True) if burr is not None]


def _certain(field: Field, doubt: Doubt, site: Site, burr: Burr) -> float:
    """How many standard deviations a burr is high, errors that neighbours share counted.

    Shared errors are as wide as they are long: over a burr's length there are as many independent ones as it
    is longer than wide.
    """
    on = site.chosen[site.on]
    lift = site.sign * field.deviation_mm[on]
    rising = lift > 0.0
    if not rising.any():
        return 0.0
    high = float(np.quantile(lift[rising], 0.8))
    crest = on[lift >= 0.5 * high]
    noise = noise_around(field, doubt, crest, site.chosen)
    width = max(burr.width_mm.value, 2.0 * field.spacing_mm)
    looks = max(burr.length_mm.value / width, 1.0)
    return high / float(np.hypot(noise.own_mm * np.sqrt(3.0 / len(crest)), noise.shared_mm / np.sqrt(looks)))


def _site(field: Field, region: Region, taken: Bools) -> Site:
    chosen = _around(field, region, taken)
    on = region.cells[field.cell[chosen, 0], field.cell[chosen, 1]]
    return Site(chosen, on, region.sign, region.significance, region.inflation)


def _around(field: Field, region: Region, taken: Bools) -> Ints:
    """Vertices in the region's bounding box and a margin, without those of other regions."""
    near = boxed(region.cells, _MARGIN, _MARGIN, closed=field.closed) & ~(taken & ~region.cells)
    return np.flatnonzero(near[field.cell[:, 0], field.cell[:, 1]])
