"""An inspection on a terminal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bench.cli.output import json_beside, told, verbose
from bench.cli.tables import plain_table, print_table
from burrscan.arrays import Floats, Ints32
from burrscan.inspection import Axis, Burr, Generatrix, Inspection, Value
from burrscan.meshio import inspection_document, write_deviation_ply

_MOST_SHOWN = 30
"""Burrs listed: a screen of them."""
_WORTH_SAYING = 1e-4
"""Probability of a wrong axis that is printed; below it, nobody would act on it."""
_USUAL_MM = (1.0, 10_000.0)
"""Extent of parts that are inspected, 1 mm to 10 m: others are more likely in another unit."""


def deliver(
    inspection: Inspection,
    vertices_mm: Floats,
    faces: Ints32,
    *,
    sigma_mm: Floats | None = None,
    json: Path | None,
    ply: Path | None,
) -> None:
    """Print what was found, and write the files that are asked for."""
    with told(json):
        print_inspection(inspection)
        if verbose():
            print("times         " + ", ".join(f"{k} {t:.2f} s" for k, t in inspection.timings_s.items()))
    with json_beside(json, inspection_document(inspection)):
        if ply:
            write_deviation_ply(ply, vertices_mm, faces, inspection.deviation_mm, sigma_mm=sigma_mm)


def print_inspection(inspection: Inspection) -> None:
    """Print axis, generatrix, burrs, and the checks that did not pass."""
    print(*_axis_lines(inspection.axis), *_generatrix_lines(inspection.generatrix), sep="\n")
    _print_burrs(inspection.burrs)
    for check in inspection.checks:
        if not check.passed:
            print(
                f"check failed  {check.name}: {check.value:.4g} {check.unit} (limit {check.limit:.4g}): "
                f"{check.reason}"
            )


def doubts(vertices_mm: Floats) -> list[str]:
    """A word about a mesh so small or large that its unit is likely another."""
    across_mm = float(np.ptp(vertices_mm, axis=0).max())
    if _USUAL_MM[0] <= across_mm <= _USUAL_MM[1]:
        return []
    return [f"the mesh is {across_mm:.3g} mm across; if its coordinates are not mm, say so with --unit"]


def _axis_lines(axis: Axis) -> list[str]:
    stated = f"± {axis.sigma_deg:.4f} deg" if math.isfinite(axis.sigma_deg) else "no deviation stated"
    if "direction" in axis.undetermined:
        stated = "any other as good"
    point, direction = _vector(axis.point_mm, 3), _vector(axis.direction, 5)
    lines = [f"axis          point {point} mm, direction {direction}, {stated}, by '{axis.method}'"]
    if axis.gross_probability >= _WORTH_SAYING:
        share = f"{100.0 * axis.gross_probability:.1g} %"
        lines.append(f"              {share} that it is grossly wrong, by over a degree or altogether")
    if axis.undetermined:
        lines.append(f"              the data leave open: {', '.join(axis.undetermined)}")
    return lines


def _generatrix_lines(curve: Generatrix) -> list[str]:
    if not np.isfinite(curve.z_mm).any():
        return ["generatrix    none"]
    z, r = (f"{np.nanmin(values):.2f} to {np.nanmax(values):.2f}" for values in (curve.z_mm, curve.r_mm))
    band = float(np.nanmedian(curve.band_mm))
    return [f"generatrix    z {z} mm, r {r} mm, the data in a band of {band:.3f} mm (median)"]


def _print_burrs(burrs: Sequence[Burr]) -> None:
    print(f"burrs         {len(burrs) or 'none'}")
    if not burrs:
        return
    judged = any(burr.within_limit is not None for burr in burrs)
    heads = ("side", "angle deg", "z mm", "height mm", "width mm", "length mm", "significance")
    table = plain_table((*heads, "verdict") if judged else heads, right=heads[1:])
    strongest = sorted(burrs, key=lambda burr: -burr.significance)[:_MOST_SHOWN]
    for burr in strongest:
        table.add_row(*_burr_cells(burr), *([_verdict(burr)] if judged else []))
    print_table(table)
    if len(burrs) > _MOST_SHOWN:
        print(f"and {len(burrs) - _MOST_SHOWN} weaker ones; --json has them all")


def _burr_cells(burr: Burr) -> list[str]:
    return [
        burr.side,
        _value(burr.angle_deg, 2),
        f"{burr.z_start_mm.value:.1f} to {burr.z_end_mm.value:.1f}",
        *(_value(value, 2) for value in (burr.height_mm, burr.width_mm, burr.length_mm)),
        f"{burr.significance:.1f}",
    ]


def _verdict(burr: Burr) -> str:
    return {True: "within", False: "[red]above[/]", None: ""}[burr.within_limit]


def _value(value: Value, digits: int) -> str:
    sigma = f" ± {value.sigma:.{digits}f}" if math.isfinite(value.sigma) else ""
    return f"{value.value:.{digits}f}{sigma}" if math.isfinite(value.value) else "–"


def _vector(vector: Floats, digits: int) -> str:
    return f"({', '.join(f'{value:.{digits}f}' for value in vector)})"
