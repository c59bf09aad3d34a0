"""What an inspection says of a workpiece: its axis, its generatrix, its burrs, and how sure that is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np

from burrscan.arrays import Floats, freeze

Side: TypeAlias = Literal["protrusion", "nick"]


@dataclass(frozen=True)
class Axis:
    """An axis of revolution in the frame of the mesh (for a scan: the camera frame).

    Parameters
    ----------
    point_mm
        (3,) the point of the axis nearest to the mean of the data.
    direction
        (3,) unit vector, in the sense that :func:`burrscan.axis.basis.sensed` gives it: to the side where
        ``x + 2 y + 4 z`` of the mesh frame is positive.
    covariance
        (4, 4) of (tilt about e1, tilt about e2 in radians; offset along e1, offset along e2 in mm), where
        e1, e2 are the part frame's x and y, the columns of
        :func:`burrscan.axis.basis.perpendicular_basis` of the direction. NaN where a method states none.
    method
        The short name of the method that found it.
    evaluations
        How often the method evaluated its quality measure.
    undetermined
        What the data leave open, such as ``("direction",)`` for a sphere, or ``("direction to 1 deg",)``
        where the axis is known, but may well be more than a degree off; empty for a well-posed shape.
    gross_probability
        Probability that the axis is another one altogether, which the covariance does not know of, or more
        than a degree off. NaN where a method states none.

    """

    point_mm: Floats
    direction: Floats
    covariance: Floats
    method: str
    evaluations: int = 0
    undetermined: tuple[str, ...] = ()
    gross_probability: float = float("nan")

    def __post_init__(self) -> None:
        freeze(self, point_mm=self.point_mm, direction=self.direction, covariance=self.covariance)

    @property
    def sigma_deg(self) -> float:
        """Standard deviation of the direction: root of the sum of the two tilt variances, degrees."""
        return float(np.degrees(np.sqrt(self.covariance[0, 0] + self.covariance[1, 1])))


@dataclass(frozen=True)
class Generatrix:
    """The profile that, turned about the axis, makes the part: a curve in the (z, r) plane.

    Parameters
    ----------
    z_mm, r_mm
        (K,) points along the curve in the part frame (``Inspection.T_part_mesh``): position along the axis,
        and distance from it.
        A NaN pair separates pieces that are not connected.
    sigma_mm
        (K,) standard deviation of the curve along its normal.
    band_mm
        (K,) thickness, along the curve's normal, of the band of data around it (the seed's accuracy test,
        section 5.2): the span between the largest deviation inwards and outwards.

    """

    z_mm: Floats
    r_mm: Floats
    sigma_mm: Floats
    band_mm: Floats

    def __post_init__(self) -> None:
        freeze(self, z_mm=self.z_mm, r_mm=self.r_mm, sigma_mm=self.sigma_mm, band_mm=self.band_mm)


@dataclass(frozen=True)
class Value:
    """A number and its standard deviation, in the unit of the field that holds it."""

    value: float
    sigma: float


@dataclass(frozen=True)
class Burr:
    """One geometrical anomaly (ISO 13715: an edge with + material is a burr, with - material an undercut).

    Parameters
    ----------
    side
        ``protrusion`` (material too much) or ``nick`` (material missing).
    angle_deg
        atan2 angle of its middle in the xy plane of ``Inspection.T_part_mesh``'s target frame.
    z_start_mm, z_end_mm
        Extent along the axis, in that frame.
    height_mm
        Largest deviation from the generatrix along its normal; positive for both sides.
    width_mm
        Base width across the burr.
    length_mm
        Length along the burr.
    area_mm2
        Mean cross-section area.
    volume_mm3
        Material too much or missing.
    T_mesh_burr
        (4, 4) pose in the frame of the mesh (for a scan: the camera frame): origin at the burr's base middle,
        x along the burr, z along the outward normal of the surface.
    significance
        Ratio of the detection statistic to its noise.
    within_limit
        The verdict against the size limit, or None where no limit was asked for.

    """

    side: Side
    angle_deg: Value
    z_start_mm: Value
    z_end_mm: Value
    height_mm: Value
    width_mm: Value
    length_mm: Value
    area_mm2: Value
    volume_mm3: Value
    T_mesh_burr: Floats
    significance: float
    within_limit: bool | None = None

    def __post_init__(self) -> None:
        freeze(self, T_mesh_burr=self.T_mesh_burr)

    @property
    def sign(self) -> int:
        """Of its deviations: +1 for material too much, -1 for material missing."""
        return 1 if self.side == "protrusion" else -1


def side_of(sign: float) -> Side:
    """What deviates by that sign: material too much from 0 up, else material missing."""
    return "protrusion" if sign >= 0.0 else "nick"


@dataclass(frozen=True)
class Check:
    """A secondary test of a solution: what was measured, what is allowed, and why it matters."""

    name: str
    passed: bool
    value: float
    limit: float
    unit: str
    reason: str


@dataclass(frozen=True)
class Inspection:
    """Everything an inspection found.

    Parameters
    ----------
    axis, generatrix, burrs
        The three results.
    T_part_mesh
        (4, 4) takes coordinates of the mesh (camera frame) to the part frame found. Without a datum it is
        the mesh frame, turned by the smallest rotation that brings its z axis onto ``axis.direction``, and
        z is zero at the foot of the perpendicular from the mesh's own origin: a part drawn along z keeps
        its z and its angles. :mod:`burrscan.axis.basis` has the rule and the one place where it jumps.
    deviation_mm
        (V,) signed distance of each vertex from the generatrix, outwards positive; NaN where none is stated.
    checks
        Secondary tests.
    timings_s
        Wall time per stage.

    """

    axis: Axis
    generatrix: Generatrix
    burrs: tuple[Burr, ...]
    T_part_mesh: Floats
    deviation_mm: Floats
    checks: tuple[Check, ...] = ()
    timings_s: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        freeze(self, T_part_mesh=self.T_part_mesh, deviation_mm=self.deviation_mm)
