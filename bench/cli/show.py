"""``burrscan show``."""

from __future__ import annotations

import argparse

from bench.cli.grammar import add_json_instead, add_trust, positive
from bench.cli.output import write_json

SUMMARY = "say what is in a suite and what a run of it will cost"
EXAMPLES = "  burrscan show quick\n  burrscan show my/suite.toml --json"


def options(parser: argparse.ArgumentParser) -> None:
    """What it takes."""
    parser.add_argument("suite", metavar="SUITE", help="a suite's name, or the path of a TOML file")
    parser.add_argument(
        "--workers", metavar="N", type=positive, help="for the estimate (default: one per core)"
    )
    add_json_instead(parser, "the suite resolved,")
    add_trust(parser, "SUITE, and check how it is called", of=["suite"])


def main(given: argparse.Namespace) -> int:
    """Print the suite. Code that it names is not imported unless the user says so."""
    from bench.run.costs import estimate, known_costs
    from bench.suites.cases import expand
    from bench.suites.catalogue import load_suite
    from bench.suites.described import described
    from scenes.renderer import usable_cores
    from scenes.transport.store import default_folder

    suite = load_suite(given.suite, code=given.trust)
    if given.json:
        write_json(given.json, suite.document())
        return 0
    cases = expand(suite)
    print("\n".join(described(suite)))
    print(f"\n{len(cases)} cases × {len(suite.variant)} variants = {len(cases) * len(suite.variant)} records")
    workers = given.workers or usable_cores()
    print(estimate(suite, cases, known_costs(default_folder()), workers=workers))
    return 0
