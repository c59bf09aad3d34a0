"""``burrscan detect``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from bench.cli.grammar import Commands, add_inspection_options, command

_DETAILS = """\
The geometry half of the pipeline on a mesh of your own, in its own frame. Angles of burrs are
counted about the axis found, from the first direction perpendicular to it (T_part_mesh in the
JSON says which; docs/inspection.schema.json describes the file). The PLY carries a float property
'deviation_mm' per vertex."""

_EXAMPLES = """\
  burrscan detect wheel.stl
  burrscan detect scan.ply --unit m --limit 0.5 --json found.json --ply deviation.ply
  burrscan detect scan.ply --axis mypackage.axes:find"""


def add(commands: Commands) -> None:
    """Declare the subcommand."""
    parser = command(
        commands,
        "detect",
        main,
        summary="find the axis, the generatrix and the burrs of a mesh you have",
        details=_DETAILS,
        examples=_EXAMPLES,
    )
    parser.add_argument("mesh", metavar="MESH", type=Path, help="a PLY, STL or OBJ file")
    parser.add_argument("--unit", default="mm", help="of the coordinates: um, mm, cm, m, inch (default: mm)")
    add_inspection_options(parser)


def main(given: argparse.Namespace) -> int:
    """Inspect the mesh and print what was found."""
    from bench.cli.findings import deliver, doubts
    from burrscan.api import inspect_mesh
    from burrscan.meshio import read_mesh

    mesh = read_mesh(given.mesh, unit=given.unit)
    for notice in (*mesh.notices, *doubts(mesh.vertices_mm)):
        print(f"note: {notice}", file=sys.stderr)
    inspection = inspect_mesh(
        mesh.vertices_mm, mesh.faces, sigma_mm=mesh.sigma_mm, axis=given.axis, limit_mm=given.limit
    )
    deliver(inspection, mesh.vertices_mm, mesh.faces, json=given.json, ply=given.ply)
    return 0
