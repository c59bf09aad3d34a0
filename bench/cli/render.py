"""``burrscan render``."""

from __future__ import annotations

import argparse
from pathlib import Path

from bench.cli.grammar import Commands, command


def add(commands: Commands) -> None:
    """Declare the subcommand."""
    parser = command(
        commands,
        "render",
        main,
        summary="render a scene to a capture folder, as if a scanner had recorded it",
        details="Pattern and camera images (PNG), rig (JSON), scene, and the truth in a file of its own.",
        examples="  burrscan render paper --out captures/paper",
    )
    parser.add_argument("scene", metavar="SCENE", help="a scene's name, or the path of a TOML file")
    parser.add_argument("--out", metavar="DIR", type=Path, required=True, help="the folder to write")
    parser.add_argument("--scan", metavar="METHOD", default="adaptive", help="strategy (default: adaptive)")
    parser.add_argument("--seed", metavar="S", type=int, default=0, help="of the noise (default: 0)")


def main(given: argparse.Namespace) -> int:
    """Render and write."""
    from scenes.capture_folder import write_capture
    from scenes.scene import load_scene

    print(write_capture(load_scene(given.scene), given.out, seed=given.seed, scan=given.scan))
    return 0
