"""``burrscan doctor``."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict

from bench.cli.grammar import Commands, command


def add(commands: Commands) -> None:
    """Declare the subcommand."""
    parser = command(commands, "doctor", main, summary="say which renderer this machine runs, and why")
    parser.add_argument("--json", action="store_true", help="as JSON, for programs")


def main(given: argparse.Namespace) -> int:
    """Print the diagnosis."""
    from scenes.renderer import doctor, render_text

    report = doctor()
    print(json.dumps(asdict(report), indent=1) if given.json else render_text(report))
    return 0
