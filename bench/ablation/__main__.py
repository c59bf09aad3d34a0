"""Leave every step of the default pipeline out in turn, and say what that costs.

    python -m bench.ablation [SUITE] [--case PATTERN] [--out FILE] [--step PART ...]

Scenes of a suite that renders (``quick`` by default) under the default pipeline and without each step; from
the stage of the step on everything runs anew. The changes are tested by sign flips over the cases, all tests
together at 5 % (Holm). FILE keeps what was measured: an interrupted run goes on.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from rich.console import Console

from bench.ablation.measure import measured
from bench.ablation.steps import STEPS, Step
from bench.ablation.table import markdown, rows
from bench.suites.case import Case
from bench.suites.cases import chosen, expand
from bench.suites.catalogue import load_suite
from burrscan.errors import InputError


def main(arguments: list[str] | None = None) -> int:
    """Measure, and print the table."""
    plain = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser("python -m bench.ablation", description=__doc__, formatter_class=plain)
    parser.add_argument("suite", nargs="?", default="quick")
    parser.add_argument("--case", default="*", metavar="PATTERN", help="only these, as of burrscan run")
    parser.add_argument("--out", type=Path, default=Path("reports/ablation.json"), metavar="FILE")
    parser.add_argument("--step", nargs="+", default=[""], metavar="PART", help="steps whose names have it")
    given = parser.parse_args(arguments)
    say = Console(stderr=True, highlight=False, soft_wrap=True).print
    try:
        cases, steps = _cases(given.suite, given.case), _steps(given.step)
        given.out.parent.mkdir(parents=True, exist_ok=True)
        seen = measured(cases, steps, given.out, progress=say)
    except (InputError, OSError) as error:
        say(f"burrscan: {error}")
        return 2
    sys.stdout.write(markdown(rows(seen, steps)))
    return 0


def _cases(name: str, pattern: str) -> tuple[Case, ...]:
    suite = load_suite(name)
    if suite.source != "scene":
        raise InputError(f"suite '{suite.name}' has no scenes to scan: name one that has, such as quick")
    return chosen(expand(suite), pattern)


def _steps(parts: list[str]) -> list[Step]:
    steps = [step for step in STEPS if any(part in step.name for part in parts)]
    if not steps:
        raise InputError(f"no step has {' or '.join(parts)} in its name")
    return steps


if __name__ == "__main__":
    sys.exit(main())
