"""``burrscan doctor``."""

from __future__ import annotations

import argparse
from dataclasses import asdict

from bench.cli.grammar import add_json_instead
from bench.cli.output import write_json

SUMMARY = "say which renderer this machine runs, and why"


def options(parser: argparse.ArgumentParser) -> None:
    """What it takes."""
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
