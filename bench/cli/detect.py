"""``burrscan detect``."""

from __future__ import annotations

import argparse
from pathlib import Path

from bench.cli.grammar import add_inspection_options
from bench.cli.output import note

SUMMARY = "find the axis, the generatrix and the burrs of a mesh you have"
DETAILS = """\
The geometry half of the pipeline on a mesh of your own: a scan, or a drawing, whose facets are
sampled. Angles and z of burrs count in the part frame: the mesh's own, turned by the smallest
rotation that brings its z axis onto the axis found; z is 0 at the foot of the mesh's origin. A part
drawn along z keeps its z and its angles. --zero, --up and --origin state another datum, which goes
with the part. T_part_mesh in the JSON is that frame (docs/inspection.schema.json). The PLY carries
a float property 'deviation_mm' per vertex, and 'sigma_mm' where MESH has it.

exit codes: 0 no burr is over --limit, or none was given; 1 one is; 2 the mesh cannot be used"""

EXAMPLES = """\
  burrscan detect wheel.stl
  burrscan detect scan.ply --unit m --limit 0.5 --json found.json --ply deviation.ply
  burrscan detect wheel.ply --zero 100 0 0 --up 0 0 1 --json - | jq .burrs
  burrscan detect scan.ply --axis mypackage.axes:find"""


def options(parser: argparse.ArgumentParser) -> None:
    """What it takes."""
    parser.add_argument("mesh", metavar="MESH", type=Path, help="a PLY, STL or OBJ file")
    parser.add_argument("--unit", default="mm", help="of the coordinates: um, mm, cm, m, inch (default: mm)")
    add_inspection_options(parser)
    for name, what in (
        ("zero", "a point at angle 0, mm, mesh frame"),
        ("up", "a direction along which z grows"),
        ("origin", "a point at z = 0, mm"),
    ):
        parser.add_argument(f"--{name}", nargs=3, metavar=("X", "Y", "Z"), type=float, help=what)


def main(given: argparse.Namespace) -> int:
    """Inspect the mesh and print what was found."""
    from bench.cli.findings import deliver, doubts
    from burrscan.api import inspect_mesh
    from burrscan.datum import Datum
    from burrscan.meshio import read_mesh

    mesh = read_mesh(given.mesh, unit=given.unit)
    for notice in (*mesh.notices, *doubts(mesh.vertices_mm)):
        note(f"note: {notice}")
    inspection = inspect_mesh(
        mesh.vertices_mm,
        mesh.faces,
        sigma_mm=mesh.sigma_mm,
        axis=given.axis,
        limit_mm=given.limit,
        datum=Datum(*(tuple(p) if p else None for p in (given.zero, given.up, given.origin))),
    )
    deliver(inspection, mesh.vertices_mm, mesh.faces, sigma_mm=mesh.sigma_mm, json=given.json, ply=given.ply)
    return int(any(burr.within_limit is False for burr in inspection.burrs))
