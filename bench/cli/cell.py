"""``burrscan cell``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from bench.cli.grammar import not_negative, positive

SUMMARY = "one wheel in a robot's cell: look around, go to its burrs, remove them"
DETAILS = """\
A simulated robot arm carries the scanner around a part on a turntable until it has seen what can be
seen, goes to the burrs it found by visual servoing, mills them off and looks again. SCENE is a scene of
the catalogue or a TOML file; tables [cell] and [task] beside it say what the robot is and what it is to do.

Into DIR come:
  cell.json           every look, what was found, and every removal
  burrs.json          the inspection, in the frame of the turntable
  part.ply            all looks in one mesh, with its deviation from the ideal surface
  paths.json, .csv    a tool path for every burr, in the robot's base frame: mm, unit vectors
  burr-1-before.png   and -after: the places that were milled

The suite `cell` compares planners over several wheels and finishes: burrscan run cell"""

EXAMPLES = """\
  burrscan cell paper --out cells/paper
  burrscan cell paper --out cells/ring --planner ring --looks 8 --remove 0"""


def options(parser: argparse.ArgumentParser) -> None:
    """What it takes."""
    parser.add_argument("scene", metavar="SCENE", help="a scene's name, or the path of a TOML file")
    parser.add_argument("--out", metavar="DIR", type=Path, required=True, help="the folder to write")
    parser.add_argument(
        "--planner", metavar="NAME", help="expected (default), greedy, ring, random, or module:function"
    )
    parser.add_argument("--looks", metavar="N", type=positive, help="at most (default: 8)")
    parser.add_argument("--remove", metavar="N", type=not_negative, help="burrs to mill off (default: 2)")
    parser.add_argument(
        "--seed", metavar="S", type=not_negative, default=0, help="of all errors (default: 0)"
    )


def main(given: argparse.Namespace) -> int:
    """Run one wheel and write what happened."""
    from bench.cell.files import write_story
    from bench.cell.spec import cell_from
    from bench.cell.story import told
    from burrscan.pipeline import Pipeline
    from scenes.scene import scene_document
    from scenes.transport.store import default_folder

    document = dict(scene_document(given.scene))
    document["task"] = _task(document.get("task", {}), given)
    case = cell_from(document, source=given.scene)
    story = told(case, Pipeline(), identity=(given.seed,), cache_dir=default_folder(), said=print)
    write_story(story, given.out)
    found = story.evidence.inspection.burrs
    print(f"{len(found)} burrs called; {100.0 * story.evidence.looks[-1].left:.1f} % that one is left")
    print(given.out)
    return 0


def _task(table: Any, given: argparse.Namespace) -> dict[str, Any]:
    """The scene's task with what the command line says."""
    said = {"planner": given.planner, "looks": given.looks, "remove": given.remove}
    return {"remove": 2, **table, **{key: value for key, value in said.items() if value is not None}}
