"""Mirror images of burrs that stand on the edge where a scan ends.

From aside and from below a burr that stands out from an edge is seen along its flank, and hardly at all. But
the metal beside it mirrors the flank: light that bounced in the corner between them comes from a place as
deep below the surface as the flank is high, and passes for a nick. It is none: what is missing from an edge
is missing at the edge most of all, and an image begins beside it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from burrscan.arrays import Ints
from burrscan.burrs.edges import at_end
from burrscan.burrs.field import Field
from burrscan.burrs.height import with_height
from burrscan.burrs.light.call import HEIGHT_PER_WIDTH
from burrscan.inspection import Burr, Value

_LONGER = 2.0
"""How much farther around the wheel than along the curve: what stands along an edge. With less it may be a
nick that runs out over it."""
_BESIDE = 4.0
"""Vertex spacings from the end of the curve within which its corner's image lies."""
_DEEPEST = 0.9
"""Quantile of its vertices that is how deep it is."""
_LOW = 0.5
"""Share of that depth from which a vertex belongs to what is low."""
_NOT_LOW = 0.3
"""Share of it that the edge is lower by at most: its vertices are halfway out of the low ones by noise alone
when that is as large, and then nothing is called."""
_THROUGH = 0.6
"""Share of the columns of the low ones that have vertices nearer to the edge."""


def is_an_image(field: Field, on: Ints) -> bool:
    """Whether what is low beside an end of the curve is not low at the edge itself.

    Parameters
    ----------
    field
        Of a scan; the curve of a mesh of many views ends elsewhere.
    on
        (M,) vertices of the anomaly.

    Notes
    -----
    O(vertices in its rows).

    """
    if not len(on) or np.ptp(field.arc_mm(on)) < _LONGER * np.ptp(field.along_mm[on]):
        return False
    depth = float(np.quantile(-field.deviation_mm[on], _DEEPEST))
    low = on[-field.deviation_mm[on] >= _LOW * depth]
    return depth > 0.0 and any(_only_beside(field, low, depth, towards=way) for way in (-1, 1))


def _only_beside(field: Field, low: Ints, depth: float, *, towards: int) -> bool:
    """Whether the curve ends near the low ones on one side, and what is nearer to that end is not low."""
    along = towards * field.along_mm
    columns = np.unique(field.cell[low, 1])
    first, last = int(field.cell[low, 0].min()), int(field.cell[low, 0].max())
    margin = int(np.ceil(_BESIDE * field.spacing_mm / field.step_mm)) + 1
    band = field.in_rows(max(first - margin, 0), min(last + margin + 1, len(field.count)))
    band = band[np.isin(field.cell[band, 1], columns)]
    end = float(along[band].max())
    beyond = towards * end + towards * field.step_mm * np.array([1.0, 2.0])
    if end - float(along[low].max()) > _BESIDE * field.spacing_mm or not at_end(field, beyond).all():
        return False
    nearest = np.full(field.count.shape[1], -np.inf)
    np.maximum.at(nearest, field.cell[low, 1], along[low])
    edge = band[along[band] > nearest[field.cell[band, 1]]]
    if len(np.unique(field.cell[edge, 1])) < _THROUGH * len(columns):
        return False
    return float(np.median(-field.deviation_mm[edge])) < _NOT_LOW * depth


def burr_of(image: Burr, *, widest_mm: float) -> Burr:
    """The burr of which what was measured as a nick is the image.

    It is at least as high as its image is deep, for the image is mixed with what lies in it; and what stands
    that is looked for at all is no higher than a certain height. Between the two its height is open.
    """
    depth = image.height_mm.value
    tallest = max(HEIGHT_PER_WIDTH * widest_mm, depth)
    spread = (tallest - depth) / np.sqrt(12.0)
    height = Value(0.5 * (depth + tallest), float(np.hypot(spread, image.height_mm.sigma)))
    burr = with_height(image, height, share=height.sigma / height.value)
    return replace(burr, side="protrusion")
