"""``burrscan suites``."""

from __future__ import annotations

import argparse

from bench.cli.grammar import Commands, command

_FEW = 5


def add(commands: Commands) -> None:
    """Declare the subcommand."""
    command(commands, "suites", main, summary="list the suites that come with burrscan")


def main(_given: argparse.Namespace) -> int:
    """Print one line per suite."""
    from bench.cli.tables import plain_table, print_table
    from bench.run.costs import estimate, known_costs
    from bench.suites.cases import expand
    from bench.suites.catalogue import load_suite, suite_names
    from scenes.renderer import usable_cores
    from scenes.transport.store import default_folder

    table = plain_table()
    for head in ("suite", "what it measures", "cases", "variants", "takes"):
        table.add_column(head)
    costs = known_costs(default_folder())
    for name in suite_names():
        suite = load_suite(name)
        cases = expand(suite)
        takes = estimate(suite, cases, costs, workers=usable_cores()).takes
        table.add_row(
            name, suite.title, str(len(cases)), _variants([variant.name for variant in suite.variant]), takes
        )
    print_table(table)
    print("times are estimates for this machine; 'burrscan show SUITE' says more")
    return 0


def _variants(names: list[str]) -> str:
    """Their names, or the first of them and how many more."""
    more = len(names) - _FEW
    return ", ".join(names) if more <= 0 else f"{', '.join(names[:_FEW])} and {more} more"
