"""The vertices around one burr, in its own frame."""

from __future__ import annotations

from dataclasses import dataclass, replace

from burrscan.arrays import Bools, Floats


@dataclass(frozen=True)
class Patch:
    """Vertices around a burr in its own frame.

    Parameters
    ----------
    u_mm, v_mm
        (N,) along the burr and across it.
    lift_mm
        (N,) deviation, positive on the burr.
    sigma_mm
        (N,) noise.
    slant
        How far across lines of sight go for each millimetre of lift: then ``v_mm`` is where they would meet
        the surface below, in which pixels are evenly spaced whatever stands on it.
    pixel_mm
        How much of that surface a pixel sees across, over which its lift is a mean; 0 where vertices are
        points, as of a mesh of which nobody knows how it was seen.
    sunk
        Whether ``lift_mm`` is a depth: a line of sight then meets the surface before what it sees.

    """

    u_mm: Floats
    v_mm: Floats
    lift_mm: Floats
    sigma_mm: Floats
    slant: float = 0.0
    pixel_mm: float = 0.0
    sunk: bool = False

    def of(self, some: Bools) -> Patch:
        """The part of it with (N,) ``some`` of its vertices."""
        arrays = (self.u_mm, self.v_mm, self.lift_mm, self.sigma_mm)
        u, v, lift, sigma = (one[some] for one in arrays)
        return replace(self, u_mm=u, v_mm=v, lift_mm=lift, sigma_mm=sigma)

    def as_points(self) -> Patch:
        """The vertices where they are, each for itself."""
        v_mm = self.v_mm + self.slant * self.lift_mm
        return replace(self, v_mm=v_mm, slant=0.0, pixel_mm=0.0, sunk=False)
