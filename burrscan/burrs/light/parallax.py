"""The order of high and low, seen from aside: what stands up appears beyond what bounced in its flank.

A camera sees what stands up displaced away from itself, over the surface that it hides. What lies below on
metal is light that bounced: off the flank towards the camera, or off the wheel before it, and both are on the
near side. In a nick whose near wall is hidden it is the other way round: the mouth shows the far wall, low,
and light that went from there to the edge and looks high lies on the near side. Where nearly all is high, or
low, nothing is in any order, and that is what it is. Nothing of that needs a model of the metal, and
:mod:`burrscan.burrs.light.section`'s is weak there: no shadow falls where the camera looks.
"""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Bools
from burrscan.burrs.light.medians import column_medians, measured_share
from burrscan.burrs.light.side import Looks
from burrscan.burrs.light.unrolled import Unrolled

MOST = 5.0
"""What this is worth, as a difference of misfits: of 338 rendered places the order was that of a ridge at 47
of 49 ridges and at 2 of 20 nicks, likelihood ratios of 7 and 14. With 4 three more are told wrong, with 6 two
less."""
_ASIDE_DEG, _FULLY_DEG = 25.0, 32.0
"""From where on the near wall of a nick is hidden: seen from nearer by both walls mirror each other, and the
order of a nick is that of a ridge. Between the two angles it counts in part."""
_NEARER_DEG = 8.0
"""By how much the projector must stand nearer to the normal: where it is as far aside there are shadows,
which the model knows, and what is below lies in them."""
_BOTH = 0.15
"""Share of what is off that must lie above, and below, to be in an order. Where less did, of 42 rendered
places, all 8 that were high are ridges, and 33 of 34 that were low are nicks."""
_MIDDLE, _CLEAR = 0.15, 0.15
"""Distance between the middles of what is above and below, over half the place, that says nothing, and how
much more or less says all that can be said."""
_BESIDE_CELLS = 2
"""What bounced reaches as far beyond the cells that are disturbed."""
_MOST_LIGHT = 2.0
"""A depth has the weight of the light that told it, over what was to be expected, to this of its logarithm, a
factor 7: beside a flank that shines a pixel on its border has a share of both, and a depth of neither. Of 285
rendered places 21 are told wrong without, 16 with 1, 13 with 2, 14 with 3."""


def parallax(cells: Bools, looks: Looks, surface: Unrolled) -> float:
    """What the order of high and low says of a place that runs along the axis.

    Parameters
    ----------
    cells
        (rows, columns) of the place on the unrolled surface.
    looks
        How bright the cells are and should be, and how far off they lie.
    surface
        The unrolled surface.

    Returns
    -------
    float
        From ``-MOST`` (material missing) to ``MOST`` (too much), as a difference of misfits; 0 where the
        camera does not stand far enough aside, or nothing was measured.

    Notes
    -----
    O(cells of the rows).

    """
    rows, columns = np.nonzero(cells)
    used, middle = np.unique(rows), float(surface.angle[columns].mean())
    camera, projector = (
        float(np.degrees(np.angle(np.exp(1j * (np.arctan2(at[1], at[0]) - middle)))))
        for at in (surface.camera_mm, surface.projector_mm)
    )
    way = 1.0 if camera > 0.0 else -1.0
    aside = np.clip((way * camera - _ASIDE_DEG) / (_FULLY_DEG - _ASIDE_DEG), 0.0, 1.0)
    if way * (camera - projector) <= _NEARER_DEG or aside == 0.0:
        return 0.0
    first = max(int(columns.min()) - _BESIDE_CELLS, 0)
    near = slice(first, int(columns.max()) + _BESIDE_CELLS + 1)
    seen = looks.deviation_mm[used, near]
    bright = column_medians(looks.light[used, near]) - column_medians(looks.predicted[used, near])
    light = np.exp(np.clip(np.nan_to_num(bright), -_MOST_LIGHT, _MOST_LIGHT))
    weight = np.nan_to_num(column_medians(seen)) * measured_share(seen) * light
    high, low = np.clip(weight, 0.0, None), np.clip(-weight, 0.0, None)
    if min(high.sum(), low.sum()) <= _BOTH * (high.sum() + low.sum()):
        return float(MOST * aside * np.sign(weight.sum()))
    away = -way * np.linspace(-1.0, 1.0, len(weight))
    order = float(high @ away / high.sum() - low @ away / low.sum())
    return float(MOST * aside * np.clip((order - _MIDDLE) / _CLEAR, -1.0, 1.0))
