"""What a scan saw besides the mesh: how bright each pixel is, and where it measured nothing."""

from __future__ import annotations

from dataclasses import dataclass

from burrscan.arrays import Floats, Floats32, freeze
from burrscan.rig import Rig


@dataclass(frozen=True)
class Sight:
    """A scan's pictures as evidence, camera frame.

    Parameters
    ----------
    radiance
        (h, w) light of each pixel under full white, any unit, NaN where it is not known.
    points_mm
        (h, w, 3) measured points, NaN where nothing was measured.
    rig
        The calibration that the points rest on.

    """

    radiance: Floats32
    points_mm: Floats
    rig: Rig

    def __post_init__(self) -> None:
        freeze(self, radiance=self.radiance, points_mm=self.points_mm)


def sight_of(radiance: Floats32 | None, points_mm: Floats, rig: Rig) -> Sight | None:
    """The sight of a scan, as :class:`Sight` takes it; none where the scan tells no light."""
    return None if radiance is None else Sight(radiance, points_mm, rig)
