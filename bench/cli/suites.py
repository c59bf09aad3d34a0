"""``burrscan suites``."""

from __future__ import annotations

import argparse
from typing import Any

from bench.cli.grammar import add_json_instead
from bench.cli.output import write_json

_FEW = 5
"""Variants named in a row of the table; it says how many more there are."""

SUMMARY = "list the suites that come with burrscan"


def options(parser: argparse.ArgumentParser) -> None:
    """What it takes."""
    add_json_instead(parser, "the same")


def main(given: argparse.Namespace) -> int:
    """Print one line per suite, or all of them for a program."""
    from bench.run.costs import estimate, known_costs
    from bench.suites.cases import expand
    from bench.suites.catalogue import load_suite, suite_names
    from scenes.renderer import usable_cores
    from scenes.transport.store import default_folder

    costs, rows = known_costs(default_folder()), []
    for name in suite_names():
        suite = load_suite(name)
        cases = expand(suite)
        takes = estimate(suite, cases, costs, workers=usable_cores()).takes
        variants = [variant.name for variant in suite.variant]
        rows.append(
            {"name": name, "title": suite.title, "cases": len(cases), "variants": variants, "takes": takes}
        )
    if given.json:
        write_json(given.json, rows)
    else:
        _print(rows)
    return 0


def _print(rows: list[dict[str, Any]]) -> None:
    from bench.cli.tables import plain_table, print_table

    table = plain_table(("suite", "what it measures", "cases", "variants", "takes"))
    for row in rows:
        table.add_row(row["name"], row["title"], str(row["cases"]), _variants(row["variants"]), row["takes"])
    print_table(table)
    print("times are estimates for this machine; 'burrscan show SUITE' says more")


def _variants(names: list[str]) -> str:
    """Their names, or the first of them and how many more."""
    more = len(names) - _FEW
    return ", ".join(names) if more <= 0 else f"{', '.join(names[:_FEW])} and {more} more"
