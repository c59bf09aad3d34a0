"""The cell as written in TOML, beside the scene that stands in it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

from pydantic import Field

from burrscan.cell.positioner import PositionerSheet
from burrscan.documents import STRICT

NotNegative = Annotated[float, Field(ge=0.0)]
Positive = Annotated[float, Field(gt=0.0)]


@dataclass(frozen=True)
class _Iso9283:
    """What the data sheet of an arm or a table says (ISO 9283)."""

    __pydantic_config__ = STRICT

    repeatability_mm: NotNegative
    repeatability_deg: NotNegative
    accuracy_mm: NotNegative
    accuracy_deg: NotNegative

    @property
    def sheet(self) -> PositionerSheet:
        """As the algorithm is told; it reaches its own place only."""
        return PositionerSheet(
            reach_mm=0.0,
            repeatability_mm=self.repeatability_mm,
            repeatability_deg=self.repeatability_deg,
            accuracy_mm=self.accuracy_mm,
            accuracy_deg=self.accuracy_deg,
        )


@dataclass(frozen=True)
class ArmSpec(_Iso9283):
    """The arm: its data sheet (ISO 9283), and where it stands.

    Parameters
    ----------
    reach_mm
        Farthest distance of the flange from its shoulder.
    shoulder_mm
        Height of its shoulder above the table's top.
    distance_mm
        Of its shoulder from the table's axis.
    repeatability_mm, repeatability_deg, accuracy_mm, accuracy_deg
        As in :class:`burrscan.cell.positioner.PositionerSheet`.
    hand_eye_mm, hand_eye_deg
        Standard deviation, along and about each axis, of what is known of the camera on the flange: what a
        calibration leaves.

    """

    reach_mm: Positive = 1300.0
    shoulder_mm: float = 300.0
    distance_mm: Positive = 900.0
    repeatability_mm: NotNegative = 0.05
    repeatability_deg: NotNegative = 0.01
    accuracy_mm: NotNegative = 0.5
    accuracy_deg: NotNegative = 0.2
    hand_eye_mm: NotNegative = 0.05
    hand_eye_deg: NotNegative = 0.02

    @property
    def sheet(self) -> PositionerSheet:
        """As the algorithm is told."""
        return replace(super().sheet, reach_mm=self.reach_mm)


@dataclass(frozen=True)
class TableSpec(_Iso9283):
    """The turntable, a disc with its axis upright; the defaults are those of a good indexing table."""

    radius_mm: Positive = 200.0
    repeatability_mm: NotNegative = 0.005
    repeatability_deg: NotNegative = 0.003
    accuracy_mm: NotNegative = 0.02
    accuracy_deg: NotNegative = 0.01


@dataclass(frozen=True)
class MillSpec:
    """The mill on the flange and what it yields.

    Parameters
    ----------
    radius_mm, length_mm
        A cylinder that cuts with its end and its side.
    stiffness_n_mm
        Of arm and mill along the mill's axis: industrial arms have 200 to 1000 N/mm at the tool.
    thrust_n_mm2
        Force along its axis per area of the section of metal being cut.

    """

    __pydantic_config__ = STRICT

    radius_mm: Positive = 2.0
    length_mm: Positive = 12.0
    stiffness_n_mm: Positive = 500.0
    thrust_n_mm2: NotNegative = 30.0


@dataclass(frozen=True)
class CellSpec:
    """Everything of the cell that is not the scene.

    Parameters
    ----------
    arm, table, mill
        The devices.
    placed_mm, placed_deg
        How far from upright in the table's middle the part is put: standard deviation along and about each
        axis. Nobody is told.
    turned_deg
        It is turned about its axis by any angle up to this: nobody marks a wheel.
    moved_mm, moved_deg
        How far somebody shifts the part before the mill comes: length of the shift along the table, angle of
        the turn about a random axis.

    """

    __pydantic_config__ = STRICT

    arm: ArmSpec = ArmSpec()
    table: TableSpec = TableSpec()
    mill: MillSpec = MillSpec()
    placed_mm: NotNegative = 2.0
    placed_deg: NotNegative = 0.5
    turned_deg: NotNegative = 360.0
    moved_mm: NotNegative = 2.0
    moved_deg: NotNegative = 1.0
