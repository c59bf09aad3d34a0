"""Metal taken off by a mill: the path it went, swept and cut from the wheel."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Annotated

import manifold3d
import numpy as np
from pydantic import Field

from burrscan.arrays import Floats
from burrscan.documents import STRICT

FACETS = 96
"""Of the mill's round side: 2 mm of radius err by a micrometre."""


@dataclass(frozen=True)
class Cut:
    """One pass of a mill, in the part frame.

    Parameters
    ----------
    tips_mm
        Places of the middle of the mill's end.
    axes
        Unit vectors from there up along the mill.
    radius_mm, length_mm
        Of the mill, which cuts with its end and its side.

    """

    __pydantic_config__ = STRICT

    tips_mm: tuple[tuple[float, float, float], ...]
    axes: tuple[tuple[float, float, float], ...]
    radius_mm: Annotated[float, Field(gt=0.0)]
    length_mm: Annotated[float, Field(gt=0.0)]

    def swept(self) -> manifold3d.Manifold:
        """What the mill went through: the union of the hulls of neighbouring places."""
        places = [
            mill(np.array(tip), np.array(axis), self.radius_mm, self.length_mm)
            for tip, axis in zip(self.tips_mm, self.axes, strict=True)
        ]
        hulls = [manifold3d.Manifold.batch_hull([here, there]) for here, there in itertools.pairwise(places)]
        return manifold3d.Manifold.batch_boolean(hulls or places, manifold3d.OpType.Add)


def mill(tip_mm: Floats, axis: Floats, radius_mm: float, length_mm: float) -> manifold3d.Manifold:
    """The mill with its end's middle at ``tip_mm``."""
    z = axis / np.linalg.norm(axis)
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x /= np.linalg.norm(x)
    placed = np.stack([x, np.cross(z, x), z, tip_mm], axis=1)
    return manifold3d.Manifold.cylinder(length_mm, radius_mm, radius_mm, FACETS).transform(placed)
