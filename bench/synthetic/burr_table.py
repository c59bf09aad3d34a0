"""Burrs found on synthetic scans against the truth, and false calls on clean ones."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from bench.synthetic.burr_bound import cramer_rao
from bench.synthetic.grids import grid_scan
from bench.synthetic.revolution import Disturbance, RevolutionScan, RidgeBurr
from burrscan.api import inspect_mesh
from burrscan.arrays import Floats
from burrscan.errors import InputError
from burrscan.inspection import Burr, Value
from burrscan.turns import turn_deg

TURNS: dict[str, tuple[float, float]] = {"along": (0.0, 0.0), "±5°": (-5.0, 5.0), "any": (-90.0, 90.0)}
"""Angle of the vertices' grid to the burr, degrees: the range it is drawn from."""
HEIGHTS_MM = (2.0, 1.5)
"""Of burrs that the table asks to be found."""
WIDTH_DEG = 0.6
"""Of the base: 0.95 mm at the mean radius, few vertices across."""
SIGMA_MM = 0.05
"""Noise along the normal, of a good scanner."""
WITHIN_DEG = 1.0
"""A burr found within this of the true angle is the true one."""
MEAN_RADIUS_MM = 91.22
"""Of the stepped wheel, along its curve: where a burr all along it has its mean cross-section."""
CLEAN: tuple[tuple[str, float, Disturbance], ...] = (
    *(("independent", arc, Disturbance(s)) for arc in (140.0, 60.0) for s in (0.05, 0.2, 1.0)),
    *(("correlated", arc, Disturbance(s, correlated_over=3)) for arc in (140.0, 60.0) for s in (0.05, 0.2)),
    *(("5 % outliers", arc, Disturbance(0.2, outlier_share=0.05)) for arc in (140.0, 60.0)),
)
"""Kinds of noise on wheels without a burr."""


@dataclass
class Tally:
    """Errors, mm or degrees, and stated standard deviations of one quantity."""

    errors: list[float] = field(default_factory=list)
    sigmas: list[float] = field(default_factory=list)

    def add(self, found: Value, true: float) -> None:
        """Count one."""
        self.errors.append(found.value - true)
        self.sigmas.append(found.sigma)

    def text(self, digits: int) -> str:
        """Median and worst error, and the root mean square of errors in units of their sigma."""
        size = np.abs(self.errors)
        pull = float(np.sqrt(np.mean((size / np.array(self.sigmas)) ** 2)))
        return f"{np.median(size):.{digits}f} {size.max():.{digits}f} {pull:.2f}"


@dataclass
class Row:
    """One kind of burr on one kind of grid."""

    grid: str
    height_mm: float
    runs: int = 0
    found: int = 0
    false: int = 0
    quantities: defaultdict[str, Tally] = field(default_factory=lambda: defaultdict(Tally))
    bounds: list[tuple[float, float]] = field(default_factory=list)


def found_rows(seeds: int) -> Iterator[Row]:
    """Every kind of grid and height, ``seeds`` scans each."""
    for grid, turns in TURNS.items():
        for height_mm in HEIGHTS_MM:
            row = Row(grid, height_mm)
            for seed in range(seeds):
                _count(row, turns, seed)
            yield row


def _count(row: Row, turns: tuple[float, float], seed: int) -> None:
    rng = np.random.default_rng(5000 + seed)
    burr = RidgeBurr(angle_deg=float(rng.uniform(-60.0, 60.0)), height_mm=row.height_mm, width_deg=WIDTH_DEG)
    scan = grid_scan(
        turn_deg=float(rng.uniform(*turns)), noise=Disturbance(SIGMA_MM), seed=seed, burrs=(burr,)
    )
    inspection = inspect_mesh(scan.vertices_mm, scan.faces)
    angles = [angle_error_deg(scan, found, burr) for found in inspection.burrs]
    right = [abs(angle) < WITHIN_DEG for angle in angles]
    row.runs, row.false = row.runs + 1, row.false + len(right) - sum(right)
    row.bounds.append(cramer_rao(_places(scan), burr, sigma_mm=SIGMA_MM))
    if any(right):
        row.found += 1
        first = right.index(True)
        _measured(row, inspection.burrs[first], angles[first], burr)


def _measured(row: Row, found: Burr, angle_error_deg: float, burr: RidgeBurr) -> None:
    area = 0.5 * burr.height_mm * np.radians(burr.width_deg) * MEAN_RADIUS_MM
    row.quantities["angle_deg"].add(Value(angle_error_deg, found.angle_deg.sigma), 0.0)
    row.quantities["height_mm"].add(found.height_mm, burr.height_mm)
    row.quantities["area_mm2"].add(found.area_mm2, area)


def angle_error_deg(scan: RevolutionScan, found: Burr, burr: RidgeBurr) -> float:
    """Angle about the true axis of the burr's pose, less the true one."""
    place = scan.T_mesh_part[:3, :3].T @ (found.T_mesh_burr[:3, 3] - scan.T_mesh_part[:3, 3])
    return turn_deg(float(np.degrees(np.arctan2(place[1], place[0]))) - burr.angle_deg)


def _places(scan: RevolutionScan) -> Floats:
    """(V, 2) true z and angle of the vertices."""
    part = (scan.vertices_mm - scan.T_mesh_part[:3, 3]) @ scan.T_mesh_part[:3, :3]
    return np.stack([part[:, 2], np.arctan2(part[:, 1], part[:, 0])], axis=1)


@dataclass
class CleanRow:
    """One kind of wheel without a burr."""

    noise: str
    arc_deg: float
    sigma_mm: float
    wheels: int = 0
    calls: int = 0
    unanswered: int = 0


def clean_rows(wheels: int) -> Iterator[CleanRow]:
    """Every kind of clean wheel; ``wheels`` in all."""
    for number, (name, arc_deg, noise) in enumerate(CLEAN):
        row = CleanRow(name, arc_deg, noise.sigma_mm)
        for seed in range(number, wheels, len(CLEAN)):
            _count_clean(row, noise, 20_000 + seed)
        yield row


def _count_clean(row: CleanRow, noise: Disturbance, seed: int) -> None:
    turn_deg = float(np.random.default_rng(seed).uniform(-90.0, 90.0))
    scan = grid_scan(turn_deg=turn_deg, noise=noise, seed=seed, arc_deg=row.arc_deg)
    row.wheels += 1
    try:
        row.calls += len(inspect_mesh(scan.vertices_mm, scan.faces).burrs)
    except InputError:
        row.unanswered += 1
