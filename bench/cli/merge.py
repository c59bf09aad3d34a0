"""``burrscan merge``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from bench.cli.grammar import add_json
from bench.cli.output import json_beside, told

SUMMARY = "align the meshes of several views and make one of them"
DETAILS = """\
Every MESH is a view of the same part in its own camera's frame, as `burrscan scan --ply` writes it.
POSES is a JSON file: the rough pose of each camera, as the robot arm knows it, in the order of the
meshes, and how good these poses are:

  {"sigma_mm": 0.5, "sigma_deg": 0.2, "T_world_camera": [[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]], ...]}

The first view keeps its pose. Where the surfaces leave something open, such as the turn of a round
part about its axis, the poses decide, and the table names it. The merged mesh is in the world frame;
`burrscan detect` reads it.

Views may be meshes or clouds, and their points much closer together than they are noisy: noise is
measured, and what is compared is averaged to a scale above it; the merged mesh is not. Views that hardly
overlap, that noise does not explain, whose distance grew or that ended far from their rough poses are
refused: exit code 2, and no file is written."""

EXAMPLES = """\
  burrscan merge left.ply middle.ply right.ply --poses poses.json --out wheel.ply --json aligned.json
  burrscan detect wheel.ply"""


def options(parser: argparse.ArgumentParser) -> None:
    """What it takes."""
    parser.add_argument(
        "meshes", metavar="MESH", type=Path, nargs="+", help="a PLY, STL or OBJ file, mm, mesh or cloud"
    )
    parser.add_argument("--poses", metavar="FILE", type=Path, required=True, help="the rough poses")
    parser.add_argument("--out", metavar="FILE", type=Path, required=True, help="the merged mesh, PLY")
    add_json(parser, "the aligned poses")


def main(given: argparse.Namespace) -> int:
    """Align, say how well, write."""
    from burrscan.ply import write_ply
    from burrscan.registration import align, merge, refuse_doubtful
    from burrscan.registration.files import alignment_document, read_views

    views, sigma_mm, sigma_deg = read_views(given.meshes, given.poses)
    found = align(views, sigma_mm=sigma_mm, sigma_deg=sigma_deg)
    refuse_doubtful(found)
    merged = merge(views, found)
    scalars = {"sigma_mm": merged.sigma_mm, "view": merged.view.astype(float)}
    with json_beside(given.json, alignment_document(found)):
        write_ply(given.out, merged.vertices_mm, merged.faces, scalars=scalars)
    with told(given.json):
        _say(given.meshes, found)
    return 0


def _say(names: list[Path], found: Any) -> None:
    import numpy as np

    from bench.cli.tables import plain_table, print_table

    heads = ("view", "moved mm", "± mm", "± deg", "overlaps with")
    table = plain_table(heads, "Poses against the first view", right=heads[1:-1])
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
            ", ".join(others),
        )
    print_table(table)
    print(
        f"distance between the views: {found.rms_mm:.4f} mm (weighted rms, point to plane); "
        f"noise alone would make {found.floor_mm:.4f} mm"
    )
    print(
        f"points are noisy by {found.noise_mm.min():.3g} to {found.noise_mm.max():.3g} mm; compared at a "
        f"distance of {found.working_mm:.3g} mm"
    )
    for number, motions in enumerate(found.free):
        for motion in motions:
            print(f"view {number + 1}: the surfaces leave open, the rough poses decide: {motion}")
