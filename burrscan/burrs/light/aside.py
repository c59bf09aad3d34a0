"""What high and low say of a place that the camera sees, or the projector lights, from aside.

*Seen from aside*: what stands up appears beyond what bounced in its flank. A camera sees what stands up
displaced away from itself, over the surface that it hides. What lies below on metal is light that bounced:
off the flank towards the camera, or off the wheel before it, and both are on the near side. In a nick whose
near wall is hidden it is the other way round: the mouth shows the far wall, low, and light that went from
there to the edge and looks high lies on the near side. Where nearly all is high, or low, nothing is in any
order, and that is what it is.

*Lit from aside*: what faces the projector shines, a ridge's near flank or a nick's far wall, and outshines
what bounced. So most of the light has come directly, and lies where the burr does.

*Crossed*: walls of a nick that mirror each other swap places, so the one towards the projector looks high and
the other low. Light that bounced between a ridge and the wheel beside it swaps the other way, unless the
camera stands farther aside than the projector: then it sees the ridge's image in the wheel, on the near side.

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
_CROSSED = 0.0, 0.15
"""Distance between the middles of high and low, towards the projector over half the place, of a ridge and of
a nick. Of 239 rendered places 75 have both: 37 nicks, all at 0.17 and more, and 38 ridges, 14 of them below
0. Lit farther aside than seen, 16 of 17 ridges have 0.12 at most."""
_FARTHER_DEG = 10.0
"""By how much the middle between camera and projector must lie on the projector's side until that tells
nicks. Without it eleven of those ridges are nicks."""
_WHOLE = 0.8
"""Share of a place that must have a depth: walls of a nick are seen, and what a ridge hides has no order. A
ridge of 2.4 mm on ground metal, a third of it hidden, was called a nick."""
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
    towards
        1 or -1: the way across that leads to the projector; 0 where it leads along the place.
    farther
        By how much it counts that the projector stands farther aside than the camera, 0 to 1.

    """

    seen: float
    lit: float
    away: float
    towards: float
    farther: float


def stand(cells: Bools, surface: Unrolled) -> Stand:
    """Where camera and projector stand to a place (rows, columns) of the unrolled surface."""
    middle = float(surface.angle[np.nonzero(cells)[1]].mean())
    camera, projector = (
        turn_deg(float(np.degrees(np.arctan2(at[1], at[0]) - middle)))
        for at in (surface.camera_mm, surface.projector_mm)
    )
    seen, lit = _share(camera, projector, _SEEN_DEG), _share(projector, camera, _LIT_DEG)
    towards = float(np.sign(projector - camera)) if abs(projector - camera) > _NEARER_DEG else 0.0
    farther = float(np.clip(0.5 * towards * (camera + projector) / _FARTHER_DEG, 0.0, 1.0))
    return Stand(seen, lit, -1.0 if camera > 0.0 else 1.0, towards, farther)


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
        From ``-MOST`` (material missing) to ``MOST`` (too much), as a difference of misfits; 0 where nothing
        was measured, or all of one side from near the normal.

    Notes
    -----
    O(cells of the rows).

    """
    depth = _depth(cells, looks)
    whole = np.isfinite(looks.deviation_mm[cells]).mean() >= _WHOLE
    crossed = (1.0 - at.seen) * _crossed(depth, at) if whole else 0.0
    one_side = at.seen * _order(depth, away=at.away) if at.seen > 0.0 else at.lit * _sign(depth)
    return MOST * float(np.clip(one_side + crossed, -1.0, 1.0))


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
    apart = _apart(depth, way=away)
    if apart is None:
        return float(np.sign(depth.sum()))
    return float(np.clip((apart - _MIDDLE) / _CLEAR, -1.0, 1.0))


def _crossed(depth: Floats, at: Stand) -> float:
    """1 where high and low lie as those of a ridge do, -1 as of a nick whose walls mirror each other."""
    apart = _apart(depth, way=at.towards)
    if apart is None or at.towards == 0.0:
        return 0.0
    ridge, nick = _CROSSED
    nick_like = float(np.clip((apart - ridge) / (nick - ridge), 0.0, 1.0))
    return 1.0 - nick_like - at.farther * nick_like


def _apart(depth: Floats, *, way: float) -> float | None:
    """How much further ``way`` the middle of what is high lies than that of what is low, over half the place.

    None where nearly all is one of them.
    """
    high, low = np.clip(depth, 0.0, None), np.clip(-depth, 0.0, None)
    if min(high.sum(), low.sum()) <= _BOTH * (high.sum() + low.sum()):
        return None
    across = way * np.linspace(-1.0, 1.0, len(depth))
    return float(high @ across / high.sum() - low @ across / low.sum())


def _sign(depth: Floats) -> float:
    """1 where all is high, -1 where all is low."""
    off = float(np.abs(depth).sum())
    return float(depth.sum()) / off if off > 0.0 else 0.0
