"""Every axis method on the same synthetic scans: errors, runs off, intervals that hold, time."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from bench.score.shape import OFF_DEG, Z_95, axis_error
from bench.synthetic.axis_bound import cramer_rao_deg
from bench.synthetic.revolution import RevolutionScan, revolution_scan
from burrscan.arrays import Bools, Floats
from burrscan.axis import find_axis
from burrscan.errors import InputError
from burrscan.inspection import Axis

SIGMAS_MM = (0.05, 0.2, 1.0)
"""Noise along the normal: of a good scanner, of a usual one, and of the seed paper."""
ARCS_DEG = (140.0, 60.0)
"""Of the turn that a scan shows: a whole view of a wheel, and a narrow one."""
SHAPE = (484, 128)
"""Vertices around and along: 122,682 triangles."""


@dataclass(frozen=True)
class Row:
    """One method on one kind of scan.

    Parameters
    ----------
    method
        Its short name.
    arc_deg, sigma_mm
        What the scans show of the part, and their noise.
    runs
        How many scans.
    median_deg, bound_deg
        Median angle between found and true axis, and the Cramér-Rao bound of its root mean square.
    off
        Runs further off than :data:`bench.score.shape.OFF_DEG`; a run without an answer counts.
    coverage
        Share of the stated 95 % intervals of tilt and offset that hold; NaN where none are stated.
    coverage_within
        Half the 95 % interval of that share, from its spread over the runs (one run's four are related).
    seconds
        Median processor time, the first run (which compiles) left out.

    """

    method: str
    arc_deg: float
    sigma_mm: float
    runs: int
    median_deg: float
    bound_deg: float
    off: int
    coverage: float
    coverage_within: float
    seconds: float


def axis_table(
    methods: Sequence[str], *, profile: str = "stepped_wheel", seeds: int = 20, shape: tuple[int, int] = SHAPE
) -> Iterator[Row]:
    """Rows of the table, as they are measured; every method sees the same scans."""
    for method, arc_deg, sigma_mm in product(methods, ARCS_DEG, SIGMAS_MM):
        yield _row(method, profile, arc_deg, sigma_mm, seeds, shape)


def _row(
    method: str, profile: str, arc_deg: float, sigma_mm: float, seeds: int, shape: tuple[int, int]
) -> Row:
    errors, inside, seconds = [], [], []
    for seed in range(seeds):
        scan = revolution_scan(profile, arc_deg=arc_deg, sigma_mm=sigma_mm, seed=seed, shape=shape)
        start = time.process_time()
        axis = _found(scan, method)
        seconds.append(time.process_time() - start)
        errors.append(scan.angle_error_deg(axis.direction) if axis else 90.0)
        if axis and np.isfinite(axis.covariance).all():
            inside.append(within_95(axis, scan))
    return Row(
        method,
        arc_deg,
        sigma_mm,
        seeds,
        float(np.median(errors)),
        cramer_rao_deg(profile, arc_deg=arc_deg, sigma_mm=sigma_mm, shape=shape),
        int(np.sum(np.array(errors) > OFF_DEG)),
        *share_held(inside),
        float(np.median(seconds[1:] or seconds)),
    )


def share_held(inside: Sequence[Bools | Floats]) -> tuple[float, float]:
    """Share of all that hold, and half its 95 % interval, of what held in each run; NaN without runs."""
    if not inside:
        return float("nan"), float("nan")
    each = np.mean(inside, axis=1)
    return float(each.mean()), float(1.96 * each.std() / np.sqrt(len(each)))


def _found(scan: RevolutionScan, method: str) -> Axis | None:
    try:
        return find_axis(scan.vertices_mm, scan.faces, method=method)
    except InputError:
        return None


def within_95(axis: Axis, scan: RevolutionScan) -> Bools:
    """(4,) whether each of two tilts and two offsets is within 1.96 of its stated sigma of the truth."""
    error = axis_error(axis, point_mm=scan.point_mm, direction=scan.direction)
    held: Bools = np.abs(error) < Z_95 * np.sqrt(np.diag(axis.covariance))
    return held
