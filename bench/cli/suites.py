"""``burrscan suites``."""

from __future__ import annotations

import argparse

from bench.cli.grammar import Commands, command


def add(commands: Commands) -> None:
    """Declare the subcommand."""
    command(commands, "suites", main, summary="list the suites that come with burrscan")


def main(_given: argparse.Namespace) -> int:
    """Print one line per suite."""
    from bench.cli.tables import plain_table, print_table
    from bench.suites.cases import expand
    from bench.suites.catalogue import load_suite, suite_names

    table = plain_table()
    for head in ("suite", "what it measures", "cases", "variants"):
        table.add_column(head)
    for name in suite_names():
        suite = load_suite(name)
        variants = ", ".join(variant.name for variant in suite.variant)
        table.add_row(name, suite.title, str(len(expand(suite))), variants)
    print_table(table)
    return 0
