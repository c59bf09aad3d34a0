"""``burrscan show``."""

from __future__ import annotations

import argparse
import json

from bench.cli.grammar import Commands, command


def add(commands: Commands) -> None:
    """Declare the subcommand."""
    parser = command(
        commands,
        "show",
        main,
        summary="say what is in a suite before it is run",
        examples="  burrscan show quick\n  burrscan show my/suite.toml --json",
    )
    parser.add_argument("suite", metavar="SUITE", help="a suite's name, or the path of a TOML file")
    parser.add_argument("--json", action="store_true", help="the suite resolved, as JSON")


def main(given: argparse.Namespace) -> int:
    """Print the suite."""
    from bench.suites.cases import expand
    from bench.suites.catalogue import load_suite
    from bench.suites.suite import Suite

    suite: Suite = load_suite(given.suite)
    if given.json:
        print(json.dumps(suite.document(), indent=1))
        return 0
    cases = expand(suite)
    print(f"{suite.name}: {suite.title}\n")
    if suite.description:
        print(suite.description.strip() + "\n")
    for path, values in suite.sweep.items():
        print(f"  sweep    {path} = {', '.join(str(value) for value in values)}")
    for path, (low, high) in suite.jitter.items():
        print(f"  jitter   {path} between {low:g} and {high:g}")
    print(f"  seeds    {', '.join(str(seed) for seed in suite.seeds)}")
    for variant in suite.variant:
        stages = ", ".join(f"{stage} = {choice}" for stage, choice in variant.stages.items())
        print(f"  variant  {variant.name}: {stages or 'every stage as usual'}")
    print(f"\n{len(cases)} cases × {len(suite.variant)} variants = {len(cases) * len(suite.variant)} records")
    return 0
