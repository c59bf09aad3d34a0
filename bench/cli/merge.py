"""``burrscan merge``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from bench.cli.grammar import Commands, add_json, command
from bench.cli.output import told, write_json

_DETAILS = """\
Every MESH is a view of the same part in its own camera's frame, as `burrscan scan --ply` writes it.
POSES is a JSON file: the rough pose of each camera, as the robot arm knows it, in the order of the
meshes, and how good these poses are:

  {"sigma_mm": 0.5, "sigma_deg": 0.2, "T_world_camera": [[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]], ...]}

The first view keeps its pose. Where the surfaces leave something open, such as the turn of a round
part about its axis, the poses decide. The merged mesh is in the world frame; `burrscan detect` reads it."""

_EXAMPLES = """\
  burrscan merge left.ply middle.ply right.ply --poses poses.json --out wheel.ply --json aligned.json
  burrscan detect wheel.ply"""


def add(commands: Commands) -> None:
    """Declare the subcommand."""
    parser = command(
        commands,
        "merge",
        main,
        summary="align the meshes of several views and make one of them",
        details=_DETAILS,
        examples=_EXAMPLES,
    )
    parser.add_argument("meshes", metavar="MESH", type=Path, nargs="+", help="a PLY, STL or OBJ file, mm")
    parser.add_argument("--poses", metavar="FILE", type=Path, required=True, help="the rough poses")
    parser.add_argument("--out", metavar="FILE", type=Path, required=True, help="the merged mesh, PLY")
    add_json(parser, "the aligned poses")


def main(given: argparse.Namespace) -> int:
    """Align, say how well, write."""
    from burrscan.ply import write_ply
    from burrscan.registration import align, merge
    from burrscan.registration.files import alignment_document, read_views

    views, sigma_mm, sigma_deg = read_views(given.meshes, given.poses)
    found = align(views, sigma_mm=sigma_mm, sigma_deg=sigma_deg)
    merged = merge(views, found)
    write_ply(
        given.out,
        merged.vertices_mm,
        merged.faces,
        scalars={"sigma_mm": merged.sigma_mm, "view": merged.view.astype(float)},
    )
    if given.json:
        write_json(given.json, alignment_document(found))
    with told(given.json):
        _say(given.meshes, found)
    return 0


def _say(names: list[Path], found: Any) -> None:
    import numpy as np

    from bench.cli.tables import plain_table, print_table

    table = plain_table("Poses against the first view")
    for head in ("view", "moved mm", "± mm", "± deg", "overlaps with"):
        table.add_column(head, justify="left" if head in {"view", "overlaps with"} else "right")
    for number, name in enumerate(names):
        spread = np.sqrt(np.diag(found.covariance[number]))
        others = [
            f"{k + 1} ({100.0 * share:.0f} %)" for k, share in enumerate(found.overlap[number]) if share > 0.0
        ]
        table.add_row(
            f"{number + 1} {name.name}",
            f"{found.moved_mm[number]:.3f}",
            f"{np.linalg.norm(spread[3:]):.4f}",
            f"{np.degrees(np.linalg.norm(spread[:3])):.4f}",
            ", ".join(others) or "nothing: its rough pose is kept",
        )
    print_table(table)
    print(f"distance between the views: {found.rms_mm:.4f} mm (weighted rms, point to plane)")
