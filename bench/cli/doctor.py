"""``burrscan doctor``."""

from __future__ import annotations

import argparse
from dataclasses import asdict

from bench.cli.grammar import Commands, add_json_instead, command
from bench.cli.output import write_json


def add(commands: Commands) -> None:
    """Declare the subcommand."""
    parser = command(commands, "doctor", main, summary="say which renderer this machine runs, and why")
    add_json_instead(parser, "the same")


def main(given: argparse.Namespace) -> int:
    """Print the diagnosis."""
    from scenes.renderer import doctor, render_text

    report = doctor()
    if given.json:
        write_json(given.json, asdict(report))
    else:
        print(render_text(report))
    return 0
