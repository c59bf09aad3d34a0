"""Taking a burr off: the path gone through by the arm, and what another look says of the place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Bools, Floats, freeze
from burrscan.cell.servo import Servoed, at_roll
from burrscan.cell.station import Station
from burrscan.cell.toolpath import ToolPath, tool_path
from burrscan.errors import InputError
from burrscan.inspection import Burr, Inspection, Value
from burrscan.pipeline import Outcome, Pipeline, run
from burrscan.pose import placed

_PATCH_MM = 1.5
"""Side of the patches whose mean deviation is judged: a pixel is 0.2 to 0.6 mm, its noise some hundredths."""
_LEAST = 4
"""Points that a patch needs."""


@dataclass(frozen=True)
class Verified:
    """What a look after the removal says of the place.

    Parameters
    ----------
    residual_mm
        The highest patch over the fitted surface, less than nothing where the place is all below it.
    gouge_mm
        The deepest patch under it.
    measured
        Share of the place's patches that the look measured.
    called
        Whether a protrusion is still called there.
    outcome
        Of the look.

    """

    residual_mm: Value
    gouge_mm: Value
    measured: float
    called: bool
    outcome: Outcome


@dataclass(frozen=True)
class Site:
    """The place of a burr in the frame of a look: pose, and half its extent along and across."""

    T_camera_burr: Floats
    half_mm: tuple[float, float]

    def __post_init__(self) -> None:
        freeze(self, T_camera_burr=self.T_camera_burr)

    def holds(self, points_mm: Floats) -> tuple[Bools, Floats]:
        """(N,) whether points lie over it, and (N, 2) where, along and across."""
        local = placed(np.linalg.inv(self.T_camera_burr), points_mm)
        over = (np.abs(local[:, :2]) <= self.half_mm).all(axis=1) & (np.abs(local[:, 2]) < 5.0 * _PATCH_MM)
        return over, local[:, :2]


def path_of(servoed: Servoed, *, radius_mm: float) -> ToolPath:
    """The path over a burr that the servo has reached, in the frame of the base.

    Raises
    ------
    InputError
        When the servo did not converge, or the mill cannot reach the burr.

    """
    last = servoed.glances[-1] if servoed.glances else None
    if not servoed.converged or servoed.burr is None or last is None or last.outcome is None:
        raise InputError(f"the mill is not over the burr: {servoed.why}")
    found = last.outcome.inspection
    return tool_path(servoed.burr, axis=found.axis, generatrix=found.generatrix, radius_mm=radius_mm).placed(
        last.T_base_camera
    )


def mill(station: Station, path: ToolPath, *, roll_deg: float) -> None:
    """Go through a path of the frame of the base: approach, every pass, retreat.

    Raises
    ------
    burrscan.cell.positioner.OutOfReachError
        When the arm cannot follow; the spindle is stopped then, the arm stands where it was.
    InputError
        When the station has no spindle.

    """
    if station.spindle is None:
        raise InputError("the station has no spindle: give Station.spindle what starts and stops the mill")
    T_tool_flange = np.linalg.inv(station.T_flange_tool)
    station.arm.move(at_roll(path.above(0), roll_deg) @ T_tool_flange)
    station.spindle.start()
    try:
        for _, pose in path.travel():
            station.arm.move(at_roll(pose, roll_deg) @ T_tool_flange)
    finally:
        station.spindle.stop()
    station.arm.move(at_roll(path.above(path.last), roll_deg) @ T_tool_flange)


def verify(
    station: Station, burr: Burr, T_camera_burr: Floats, *, pipeline: Pipeline | None = None
) -> Verified:
    """Look at the place from where the camera is, and judge it.

    Parameters
    ----------
    station
        Its arm stands where the place is in sight.
    burr
        As it was.
    T_camera_burr
        (4, 4) where its place is in this look.
    pipeline
        Of the look.

    """
    outcome = run(station.scanner, pipeline or Pipeline())
    half = (
        0.5 * burr.length_mm.value,
        0.5 * burr.width_mm.value + 0.5 * max(burr.height_mm.value, 0.0),
    )
    site = Site(T_camera_burr, half)
    return judged(outcome, site)


def judged(outcome: Outcome, site: Site) -> Verified:
    """What an outcome says of a place, patch by patch. O(vertices)."""
    over, local = site.holds(outcome.surface.vertices_mm)
    deviation = outcome.inspection.deviation_mm
    over = over & np.isfinite(deviation)
    cells = np.floor((local[over] + np.array(site.half_mm)) / _PATCH_MM).astype(int)
    shape = np.maximum(np.ceil(2.0 * np.array(site.half_mm) / _PATCH_MM).astype(int), 1)
    cells = np.minimum(cells, shape - 1)
    number = cells[:, 0] * shape[1] + cells[:, 1]
    count = np.bincount(number, minlength=int(shape.prod()))
    total = np.bincount(number, deviation[over], len(count))
    variance = np.bincount(number, outcome.surface.vertex_sigma_mm[over] ** 2, len(count))
    known = count >= _LEAST
    mean = total[known] / count[known]
    sigma = np.sqrt(variance[known]) / count[known]
    if not known.any():
        nothing = Value(float("nan"), float("nan"))
        return Verified(nothing, nothing, 0.0, _called(outcome.inspection, site), outcome)
    high, low = int(np.argmax(mean)), int(np.argmin(mean))
    return Verified(
        Value(float(mean[high]), float(sigma[high])),
        Value(float(-mean[low]), float(sigma[low])),
        float(known.mean()),
        _called(outcome.inspection, site),
        outcome,
    )


def _called(inspection: Inspection, site: Site) -> bool:
    poses = [b.T_mesh_burr for b in inspection.burrs if b.side == "protrusion"]
    middles = np.array([pose[:3, 3] for pose in poses if np.isfinite(pose).all()]).reshape(-1, 3)
    return bool(site.holds(middles)[0].any())
