"""What a scan saw besides the mesh: how bright each pixel is, and where it measured nothing."""

from __future__ import annotations

from dataclasses import dataclass

from burrscan.arrays import Floats, Floats32, freeze
from burrscan.rig import Rig
from burrscan.surface import Surface


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
    sigma_mm
        (h, w) standard deviation of each point along its ray, NaN where there is none; as a scan states it.

    """

    radiance: Floats32
    points_mm: Floats
    rig: Rig
    sigma_mm: Floats32

    def __post_init__(self) -> None:
        freeze(self, radiance=self.radiance, points_mm=self.points_mm, sigma_mm=self.sigma_mm)


def sight_of(radiance: Floats32 | None, surface: Surface, rig: Rig) -> Sight | None:
    """The sight of a scan, as :class:`Sight` takes it; none where the scan tells no light."""
    return None if radiance is None else Sight(radiance, surface.points_mm, rig, surface.sigma_mm)
