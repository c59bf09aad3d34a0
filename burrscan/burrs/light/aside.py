"""What high and low say of a place that the camera sees, or the projector lights, from aside.

*Seen from aside*: what stands up appears beyond what bounced in its flank. A camera sees what stands up
displaced away from itself, over the surface that it hides. What lies below on metal is light that bounced:
off the flank towards the camera, or off the wheel before it, and both are on the near side. In a nick whose
near wall is hidden it is the other way round: the mouth shows the far wall, low, and light that went from
there to the edge and looks high lies on the near side. Where nearly all is high, or low, nothing is in any
order, and that is what it is.

*Lit from aside*: what faces the projector shines, a ridge's near flank or a nick's far wall, and outshines
what bounced. So most of the light has come directly, and lies where the burr does.

Nothing of that needs a model of the metal, and :mod:`burrscan.burrs.light.section`'s is weak there: no shadow
falls where the camera looks, and walls lit flatly mirror each other more than once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from burrscan.arrays import Bools, Floats
from burrscan.burrs.light.medians import column_medians, measured_share
from burrscan.burrs.light.side import Looks
from burrscan.burrs.light.unrolled import Unrolled
from burrscan.turns import turn_deg

MOST = 5.0
"""What this is worth, as a difference of misfits: of 338 rendered places the order was that of a ridge at 47
of 49 ridges and at 2 of 20 nicks, likelihood ratios of 7 and 14. With 4 three more are told wrong, with 6 two
less. Lit from aside, 239 of 250 ridges are high by their light, and 70 of 71 nicks low."""
_SEEN_DEG = 25.0, 32.0
"""From where on the near wall of a nick is hidden: seen from nearer by both walls mirror each other, and the
order of a nick is that of a ridge. Between the two angles it counts in part."""
_LIT_DEG = 30.0, 40.0
"""From where on one flank alone is lit, as :data:`_SEEN_DEG`. Of 321 rendered places that are lit so 15 are
told wrong without this, 6 with it, 6 from 25 or 35 degrees on as well."""
_NEARER_DEG = 8.0
"""By how much the one of the two must stand nearer to the normal. Where both are as far aside there are
shadows, which the model knows, and what is below lies in them."""
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
places seen from aside 21 are told wrong without, 16 with 1, 13 with 2, 14 with 3."""


class Stand(NamedTuple):
    """Where camera and projector stand to a place.

    Parameters
    ----------
    seen, lit
        By how much it counts that it is seen, or lit, from aside: 0 to 1, one of them 0.
    away
        1 or -1: the way across, in angles, that leads away from the camera.

    """

    seen: float
    lit: float
    away: float


def stand(cells: Bools, surface: Unrolled) -> Stand:
    """Where camera and projector stand to a place (rows, columns) of the unrolled surface."""
    middle = float(surface.angle[np.nonzero(cells)[1]].mean())
    camera, projector = (
        turn_deg(float(np.degrees(np.arctan2(at[1], at[0]) - middle)))
        for at in (surface.camera_mm, surface.projector_mm)
    )
    seen, lit = _share(camera, projector, _SEEN_DEG), _share(projector, camera, _LIT_DEG)
    return Stand(seen, lit, -1.0 if camera > 0.0 else 1.0)


def aside(cells: Bools, looks: Looks, at: Stand) -> float:
    """What high and low say of a place that runs along the axis.

    Parameters
    ----------
    cells
        (rows, columns) of the place on the unrolled surface.
    looks
        How bright the cells are and should be, and how far off they lie.
    at
        Where camera and projector stand to it.

    Returns
    -------
    float
        From ``-MOST`` (material missing) to ``MOST`` (too much), as a difference of misfits; 0 where neither
        camera nor projector stands far enough aside, or nothing was measured.

    Notes
    -----
    O(cells of the rows).

    """
    if at.seen > 0.0:
        return MOST * at.seen * _order(_depth(cells, looks), away=at.away)
    return MOST * at.lit * _sign(_depth(cells, looks)) if at.lit > 0.0 else 0.0


def _share(one_deg: float, other_deg: float, between_deg: tuple[float, float]) -> float:
    """How much it counts that one of them stands aside, 0 to 1: not at all if the other stands there too."""
    way = 1.0 if one_deg > 0.0 else -1.0
    if way * (one_deg - other_deg) <= _NEARER_DEG:
        return 0.0
    first, full = between_deg
    return float(np.clip((way * one_deg - first) / (full - first), 0.0, 1.0))


def _depth(cells: Bools, looks: Looks) -> Floats:
    """(columns,) depths across a place, each with the weight of its light."""
    rows, columns = np.nonzero(cells)
    used, first = np.unique(rows), max(int(columns.min()) - _BESIDE_CELLS, 0)
    near = slice(first, int(columns.max()) + _BESIDE_CELLS + 1)
    depth = looks.deviation_mm[used, near]
    bright = column_medians(looks.light[used, near]) - column_medians(looks.predicted[used, near])
    light = np.exp(np.clip(np.nan_to_num(bright), -_MOST_LIGHT, _MOST_LIGHT))
    return np.nan_to_num(column_medians(depth)) * measured_share(depth) * light


def _order(depth: Floats, *, away: float) -> float:
    """1 where high lies beyond low, -1 the other way round; ``away`` is the way from the camera."""
    high, low = np.clip(depth, 0.0, None), np.clip(-depth, 0.0, None)
    if min(high.sum(), low.sum()) <= _BOTH * (high.sum() + low.sum()):
        return float(np.sign(depth.sum()))
    across = away * np.linspace(-1.0, 1.0, len(depth))
    order = float(high @ across / high.sum() - low @ across / low.sum())
    return float(np.clip((order - _MIDDLE) / _CLEAR, -1.0, 1.0))


def _sign(depth: Floats) -> float:
    """1 where all is high, -1 where all is low."""
    off = float(np.abs(depth).sum())
    return float(depth.sum()) / off if off > 0.0 else 0.0
