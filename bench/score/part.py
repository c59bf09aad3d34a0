"""What is known of a part whose mesh alone was inspected: evidence without a scan."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bench.score.matching import Matching, match_places
from bench.score.places import along_axis_mm, found_place, true_place
from burrscan.arrays import Floats, freeze
from burrscan.inspection import Inspection
from scenes.wheel import TrueBurr


@dataclass(frozen=True)
class MeshTruth:
    """The truth of a synthetic mesh.

    Parameters
    ----------
    T_part_mesh
        (4, 4) from the mesh's frame to the true part frame.
    generatrix_zr_mm
        (K, 2) the true outline, the outside to its left.
    burrs
        Those that are there.
    axis_bound
        (4, 4) Cramér-Rao bound of tilts in rad and offsets in mm at z = 0; None where it is not known.

    """

    T_part_mesh: Floats
    generatrix_zr_mm: Floats
    burrs: tuple[TrueBurr, ...]
    axis_bound: Floats | None

    def __post_init__(self) -> None:
        freeze(self, T_part_mesh=self.T_part_mesh, generatrix_zr_mm=self.generatrix_zr_mm)


@dataclass(frozen=True)
class MeshEvidence:
    """One variant's inspection of a mesh, and the truth of that mesh."""

    truth: MeshTruth
    inspection: Inspection

    @property
    def true_generatrix_zr_mm(self) -> Floats:
        """(K, 2) the true outline."""
        return self.truth.generatrix_zr_mm

    @property
    def true_burrs(self) -> tuple[TrueBurr, ...]:
        """The burrs that are there."""
        return self.truth.burrs

    @property
    def T_part_mesh(self) -> Floats:  # noqa: N802 (T_target_source)
        """(4, 4) from the mesh's frame to the true part frame."""
        return self.truth.T_part_mesh

    @property
    def axis_bound(self) -> Floats | None:
        """(4, 4) Cramér-Rao bound of the axis."""
        return self.truth.axis_bound

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


def part_found(T_part_mesh: Floats, inspection: Inspection) -> Floats:
    """(4, 4) from the part frame that was found to the true one."""
    return T_part_mesh @ np.linalg.inv(inspection.T_part_mesh)


def generatrix_in_part(T_part_found: Floats, inspection: Inspection) -> Floats:
    """(K, 2) the generatrix found, its z carried to the true part frame, its r as found."""
    found = inspection.generatrix
    return np.column_stack([along_axis_mm(T_part_found, found.z_mm), found.r_mm])


def matched(
    burrs: tuple[TrueBurr, ...], inspection: Inspection, T_part_mesh: Floats, T_part_found: Floats
) -> Matching:
    """Burrs found against true burrs, all in the true part frame."""
    found = [found_place(b, T_part_camera=T_part_mesh, T_part_found=T_part_found) for b in inspection.burrs]
    return match_places([true_place(burr) for burr in burrs], found)
