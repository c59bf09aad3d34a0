"""``burrscan suites``."""

from __future__ import annotations

import argparse

from bench.cli.grammar import Commands, command


def add(commands: Commands) -> None:
    """Declare the subcommand."""
    command(commands, "suites", main, summary="list the suites that come with burrscan")


def main(_given: argparse.Namespace) -> int:
    """Print one line per suite."""
    from rich.console import Console
    from rich.table import Table

    from bench.suites.cases import expand
    from bench.suites.catalogue import load_suite, suite_names

    table = Table(box=None, pad_edge=False)
    for head in ("suite", "what it measures", "cases", "variants"):
        table.add_column(head)
    for name in suite_names():
        suite = load_suite(name)
        variants = ", ".join(variant.name for variant in suite.variant)
        table.add_row(name, suite.title, str(len(expand(suite))), variants)
    Console().print(table)
    return 0
