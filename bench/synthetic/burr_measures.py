"""Everything else that is said of a burr or nick, against the truth."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from bench.synthetic.burr_table import SIGMA_MM, WITHIN_DEG, Tally, angle_error_deg
from bench.synthetic.grids import grid_scan
from bench.synthetic.revolution import Disturbance, RevolutionScan, RidgeBurr
from burrscan.api import inspect_mesh
from burrscan.axis.basis import origin_mm
from burrscan.inspection import Burr, Inspection, Value

SIZES_MM = {"protrusion": 1.2, "nick": -1.2}
"""Heights of the two sides, out of and into the surface."""
WIDTH_DEG = 1.0
"""Of the base: 1.6 mm at the radius of 90 mm."""
ENDS_MM = (-10.0, 6.0)
"""On the middle face of the stepped wheel, whose radius is 90 mm at z = -12 and grows by a tenth of z."""


@dataclass
class MeasureRow:
    """One side, and per quantity the errors; ``normal_deg``: of the z axis of the pose, with no sigma."""

    side: str
    runs: int = 0
    found: int = 0
    quantities: defaultdict[str, Tally] = field(default_factory=lambda: defaultdict(Tally))
    normal_deg: list[float] = field(default_factory=list)
    off_mm: list[float] = field(default_factory=list)


def measure_rows(seeds: int) -> Iterator[MeasureRow]:
    """Protrusions and nicks, ``seeds`` scans each, the grid at any angle."""
    for side, height_mm in SIZES_MM.items():
        row = MeasureRow(side)
        for seed in range(seeds):
            _count(row, height_mm, seed)
        yield row


def _count(row: MeasureRow, height_mm: float, seed: int) -> None:
    rng = np.random.default_rng(7000 + seed)
    burr = RidgeBurr(float(rng.uniform(-60.0, 60.0)), height_mm, WIDTH_DEG, *ENDS_MM)
    turn_deg = float(rng.uniform(-90.0, 90.0))
    scan = grid_scan(turn_deg=turn_deg, noise=Disturbance(SIGMA_MM), seed=7000 + seed, burrs=(burr,))
    inspection = inspect_mesh(scan.vertices_mm, scan.faces)
    row.runs += 1
    near = [b for b in inspection.burrs if abs(angle_error_deg(scan, b, burr)) < WITHIN_DEG]
    right = [b for b in near if b.side == row.side]
    if right:
        row.found += 1
        _measured(row, scan, inspection, right[0], burr)


def _measured(
    row: MeasureRow, scan: RevolutionScan, inspection: Inspection, found: Burr, burr: RidgeBurr
) -> None:
    slope = 0.1
    length = (ENDS_MM[1] - ENDS_MM[0]) * float(np.hypot(1.0, slope))
    radius = 90.0 + slope * (0.5 * sum(ENDS_MM) + 12.0)
    width, height = np.radians(burr.width_deg) * radius, abs(burr.height_mm)
    row.quantities["angle_deg"].add(Value(angle_error_deg(scan, found, burr), found.angle_deg.sigma), 0.0)
    row.quantities["height_mm"].add(found.height_mm, height)
    row.quantities["width_mm"].add(found.width_mm, width)
    row.quantities["area_mm2"].add(found.area_mm2, 0.5 * height * width)
    row.quantities["length_mm"].add(found.length_mm, length)
    row.quantities["volume_mm3"].add(found.volume_mm3, 0.5 * height * width * length)
    for end, true in zip(_ends(scan, inspection, found), ENDS_MM, strict=True):
        row.quantities["end_mm"].add(end, true)
    row.normal_deg.append(_normal_error_deg(scan, found, burr, slope))
    row.off_mm.append(_height_off_mm(scan, found, slope))


def _ends(scan: RevolutionScan, inspection: Inspection, found: Burr) -> list[Value]:
    """Both ends as positions along the true axis, the lower first: the axis found may point either way."""
    axis = inspection.axis
    start, sense = (
        float((origin_mm(axis.point_mm, axis.direction) - scan.point_mm) @ scan.direction),
        axis.direction @ scan.direction,
    )
    ends = [Value(start + float(sense) * end.value, end.sigma) for end in (found.z_start_mm, found.z_end_mm)]
    return sorted(ends, key=lambda end: end.value)


def _normal_error_deg(scan: RevolutionScan, found: Burr, burr: RidgeBurr, slope: float) -> float:
    turn = np.radians(burr.angle_deg)
    true = scan.T_mesh_part[:3, :3] @ [np.cos(turn), np.sin(turn), -slope]
    cosine = found.T_mesh_burr[:3, 2] @ true / np.linalg.norm(true)
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))


def _height_off_mm(scan: RevolutionScan, found: Burr, slope: float) -> float:
    """How far the pose's origin is off the ideal surface."""
    part = scan.T_mesh_part[:3, :3].T @ (found.T_mesh_burr[:3, 3] - scan.T_mesh_part[:3, 3])
    gap = np.hypot(part[0], part[1]) - (90.0 + slope * (part[2] + 12.0))
    return float(abs(gap) / np.hypot(1.0, slope))
