"""What metrics look at: one outcome beside the truth, and the quantities that several metrics share."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bench.score.matching import Matching
from bench.score.part import MeshEvidence, generatrix_in_part, matched, part_found
from burrscan.arrays import Bools, Floats
from burrscan.inspection import Inspection
from burrscan.pipeline import Outcome
from scenes.bound import Bounds
from scenes.truth import Truth
from scenes.wheel import TrueBurr

RIGHT_WITHIN_PX = 1.0
"""A correspondence is right within this distance of the truth, projector pixels (issue 2)."""


@dataclass(frozen=True)
class Evidence:
    """One variant's outcome of one scanned case, and the truth of that case.

    It says all of the part that :class:`bench.score.part.MeshEvidence` does; its mesh frame is the camera's.

    Parameters
    ----------
    truth, outcome
        The two sides.
    bounds
        Cramér-Rao bounds of the frames shown (:mod:`scenes.bound`), NaN where they were not computed; None
        where nobody watched the scanner.
    dprimes
        Per true burr, how well the frames shown could tell it (:mod:`scenes.detectability`); empty where that
        was not asked for.
    side_dprimes
        As well, of it and a burr of the same size on the other side of the surface; NaN for a rim burr.

    """

    truth: Truth
    outcome: Outcome
    bounds: Bounds | None = None
    dprimes: tuple[float, ...] = ()
    side_dprimes: tuple[float, ...] = ()

    @cached_property
    def accepted(self) -> Bools:
        """(h, w) pixels whose correspondence the scan stands for."""
        correspondence = self.outcome.scan.correspondence
        return correspondence.mask & np.isfinite(correspondence.u_px)

    @cached_property
    def right(self) -> Bools:
        """(h, w) accepted pixels within :data:`RIGHT_WITHIN_PX` of the response-weighted true column."""
        error = np.abs(self.outcome.scan.correspondence.u_px - self.truth.u_response_px)
        near: Bools = error <= RIGHT_WITHIN_PX  # a NaN truth compares False: nothing is there
        return self.accepted & near

    @cached_property
    def inlier_error_px(self) -> Floats:
        """(h, w) column minus response-weighted true column; NaN for pixels that are not right."""
        error = self.outcome.scan.correspondence.u_px - self.truth.u_response_px
        return np.where(self.right, error, np.nan)

    @cached_property
    def depth_error_mm(self) -> Floats:
        """(h, w) measured minus true depth at the pixel centre, along the camera's z; NaN for no inlier.

        An inlier's correspondence is right for the pixel's whole footprint and for its centre alike: at a
        step in depth the two belong to different surfaces, and no depth is the true one.
        """
        off_centre = np.abs(self.outcome.scan.correspondence.u_px - self.truth.u_px)
        stated = self.right & (off_centre <= RIGHT_WITHIN_PX)
        error = self.outcome.surface.points_mm[..., 2] - self.truth.points_mm[..., 2]
        return np.where(stated, error, np.nan)

    @property
    def inspection(self) -> Inspection:
        """What was found on the mesh."""
        return self.outcome.inspection

    @property
    def true_generatrix_zr_mm(self) -> Floats:
        """(K, 2) the true outline, the outside to its left."""
        return self.truth.wheel.generatrix_zr_mm

    @property
    def true_burrs(self) -> tuple[TrueBurr, ...]:
        """The burrs that are there."""
        return self.truth.wheel.burrs

    @property
    def T_part_mesh(self) -> Floats:  # noqa: N802 (T_target_source)
        """(4, 4) from the camera frame to the true part frame."""
        return self.truth.T_part_camera

    @property
    def axis_bound(self) -> Floats | None:
        """No bound of the axis is known for a scan: its noise is neither independent nor even."""
        return None

    @cached_property
    def T_part_found(self) -> Floats:  # noqa: N802
        """(4, 4) from the part frame that was found to the true one."""
        return part_found(self.T_part_mesh, self.inspection)

    @cached_property
    def generatrix_zr_mm(self) -> Floats:
        """(K, 2) the generatrix found, its z carried to the true part frame, its r as found."""
        return generatrix_in_part(self.T_part_found, self.inspection)

    @cached_property
    def matching(self) -> Matching:
        """Burrs found against true burrs."""
        return matched(self.true_burrs, self.inspection, self.T_part_mesh, self.T_part_found)


PartEvidence = Evidence | MeshEvidence
"""What metrics of axis, generatrix and burrs look at: an inspection beside the truth of the part."""
