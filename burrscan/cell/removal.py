"""Taking a burr off: the path over a burr that was reached, and what another look says of the place."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from burrscan.arrays import Bools, Floats, freeze
from burrscan.burrs.pose import share_around
from burrscan.cell.positioner import OutOfReachError
from burrscan.cell.servo import Servoed
from burrscan.cell.station import Station
from burrscan.cell.toolpath import ToolPath, tool_path
from burrscan.cell.toolpose import move_tool
from burrscan.errors import InputError
from burrscan.inspection import Burr, Inspection, Value
from burrscan.pipeline import Outcome, Pipeline, run
from burrscan.pose import placed

_PATCH_MM = 1.5
"""Side of the patches whose mean deviation is judged: a pixel is 0.2 to 0.6 mm, its noise some hundredths."""
_LEAST = 4
"""Points that a patch needs."""
_ENOUGH = 0.5
"""Share of the patches that a look must measure to speak for the place: where it measures less, the mill left
a mirror, and from the other end light comes back another way."""


@dataclass(frozen=True)
class Verified:
    """What a look after the removal says of the place.

    Parameters
    ----------
    residual_mm
        The highest patch over the fitted surface, less than nothing where the place is all below it; NaN
        where nothing of the place was measured.
    gouge_mm
        The deepest patch under it, likewise.
    measured
        Share of the place's patches that the look measured.
    called
        Whether a protrusion is still called there.
    site
        The place in the look's frame.
    outcome
        Of the look; None where it shows no surface of revolution.
    why
        What the pipeline said then.

    """

    residual_mm: Value
    gouge_mm: Value
    measured: float
    called: bool
    site: Site
    outcome: Outcome | None
    why: str = ""


@dataclass(frozen=True)
class Site:
    """The place of a burr in the frame of a look: pose, and half its extent along and across, mm."""

    T_camera_burr: Floats
    half_mm: tuple[float, float]

    def __post_init__(self) -> None:
        freeze(self, T_camera_burr=self.T_camera_burr)

    def holds(self, points_mm: Floats) -> tuple[Bools, Floats]:
        """(N,) whether points lie over it, and (N, 2) where, along and across."""
        local = placed(np.linalg.inv(self.T_camera_burr), points_mm)
        over = (np.abs(local[:, :2]) <= self.half_mm).all(axis=1) & (np.abs(local[:, 2]) < 5.0 * _PATCH_MM)
        return over, local[:, :2]


def path_of(station: Station, servoed: Servoed, *, radius_mm: float) -> ToolPath:
    """The path of a mill over a burr that the servo has reached, in the frame of the base.

    Raises
    ------
    InputError
        When the servo did not converge, or the mill cannot reach the burr.

    """
    burr, T_base_mesh, _, inspection = servoed.arrived()
    path = tool_path(
        burr,
        axis=inspection.axis,
        generatrix=inspection.generatrix,
        radius_mm=radius_mm,
        scatter_mm=station.plunge_mm,
    )
    return path.placed(T_base_mesh)


def verify(station: Station, servoed: Servoed, *, pipeline: Pipeline | None = None) -> Verified:
    """Look at the place of a burr that was milled, and judge it.

    The arm goes back to where the servo's last look was made. Where less than half of the place is measured
    from there, it looks from the other end of the burr too, if it can, and what measures more of the place is
    returned. The arm is off by another error there: the place is larger by two standard deviations of it.

    Parameters
    ----------
    station
        The cell; its table has not been turned since.
    servoed
        How the burr was reached.
    pipeline
        Of the looks.

    Raises
    ------
    InputError
        When the servo did not converge.
    burrscan.cell.positioner.OutOfReachError
        When the arm cannot go back.

    """
    if servoed.burr is None or servoed.T_base_mesh is None:
        raise InputError(f"there is no place to look at: {servoed.why}")
    eye = servoed.glances[-1].T_base_camera
    burr = replace(servoed.burr, T_mesh_burr=servoed.T_base_mesh @ servoed.burr.T_mesh_burr)
    bent_mm = _bent_mm(servoed)
    first = _seen(station, burr, eye, bent_mm, roll_deg=0.0, pipeline=pipeline)
    if first.measured >= _ENOUGH:
        return first
    try:
        other = _seen(station, burr, eye, bent_mm, roll_deg=180.0, pipeline=pipeline)
    except OutOfReachError:
        return first
    return max(first, other, key=lambda one: one.measured)


def _bent_mm(servoed: Servoed) -> float:
    """By how much the ends of a burr that goes around the axis are beside its straight middle line."""
    last = servoed.glances[-1].outcome
    if servoed.burr is None or last is None:
        return 0.0
    axis, burr = last.inspection.axis, servoed.burr
    radius = float(np.linalg.norm(np.cross(axis.direction, burr.T_mesh_burr[:3, 3] - axis.point_mm)))
    return share_around(burr, axis) ** 2 * burr.length_mm.value**2 / (8.0 * max(radius, 1e-9))


def _seen(
    station: Station,
    burr: Burr,
    T_base_camera: Floats,
    bent_mm: float,
    *,
    roll_deg: float,
    pipeline: Pipeline | None,
) -> Verified:
    """What a look from a pose, turned about the mill, says of a burr's place; its frame is the base's."""
    T_base_tool = np.asarray(T_base_camera @ station.T_camera_tool, float)
    reported, _ = move_tool(station, T_base_tool, rolls=(roll_deg,))
    sheet = station.arm.sheet
    swing = 2.0 * np.hypot(sheet.offset_mm, station.lever_mm * np.radians(sheet.offset_deg))
    more = float(swing) if roll_deg else 0.0
    half = (
        0.5 * burr.length_mm.value + more,
        0.5 * burr.width_mm.value + 0.5 * max(burr.height_mm.value, 0.0) + more + bent_mm,
    )
    site = Site(np.asarray(np.linalg.inv(reported) @ burr.T_mesh_burr, float), half)
    try:
        return judged(run(station.scanner, pipeline or Pipeline()), site)
    except InputError as error:
        nothing = Value(float("nan"), float("nan"))
        return Verified(nothing, nothing, 0.0, called=False, site=site, outcome=None, why=str(error))


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
        return Verified(nothing, nothing, 0.0, _called(outcome.inspection, site), site, outcome)
    high, low = int(np.argmax(mean)), int(np.argmin(mean))
    return Verified(
        Value(float(mean[high]), float(sigma[high])),
        Value(float(-mean[low]), float(sigma[low])),
        float(known.mean()),
        _called(outcome.inspection, site),
        site,
        outcome,
    )


def _called(inspection: Inspection, site: Site) -> bool:
    poses = [b.T_mesh_burr for b in inspection.burrs if b.side == "protrusion"]
    middles = np.array([pose[:3, 3] for pose in poses if np.isfinite(pose).all()]).reshape(-1, 3)
    return bool(site.holds(middles)[0].any())
