"""The command ``burrscan``."""

from __future__ import annotations

import argparse
import importlib
import logging
import sys
import traceback
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path

from bench.cli.grammar import Parser, add_verbosity
from bench.cli.output import set_verbosity, verbose

COMMANDS = (
    "doctor", "run", "compare", "accept", "history", "report", "leaderboard", "suites", "show", "render",
    "scan", "calibrate", "merge", "detect", "paper", "completion",
)  # fmt: skip
"""Subcommands in the order of the help; each is a module of this package with ``add`` and ``main``."""

_DESCRIPTION = """\
How well does a scan-to-burr algorithm see burrs on shiny turned metal?

burrscan renders synthetic metallic wheels under the patterns a scanner projects, runs the whole
pipeline on those images and scores every stage against exact truth."""

_EXAMPLES = """\
examples:
  burrscan doctor                     what this machine can render with
  burrscan run quick                  the quick suite, score table and HTML report
  burrscan compare BEFORE AFTER       what got better or worse, by how much, how sure that is
  burrscan detect wheel.stl           axis, generatrix and burrs of a mesh you have

exit codes: 0 done, 1 a gate is broken (compare) or a burr is over the limit (detect --limit), 2 the input
cannot be used (the message says why), 130 interrupted"""


def parser() -> argparse.ArgumentParser:
    """The command line's grammar."""
    top = Parser(
        prog="burrscan",
        description=_DESCRIPTION,
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    top.add_argument("-V", "--version", action="version", version=f"burrscan {metadata.version('burrscan')}")
    add_verbosity(top, default=0)
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name in COMMANDS:
        importlib.import_module(f"bench.cli.{name}").add(commands)
    return top


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; the exit code is returned. Packages in the current directory are found, last."""
    logging.basicConfig(format="%(message)s", level=logging.WARNING)
    given = parser().parse_args(arguments)
    set_verbosity(given.verbosity)
    if (here := str(Path.cwd())) not in sys.path:
        sys.path.append(here)
    from burrscan.errors import InputError

    try:
        return int(given.main(given))
    except InputError as error:
        if verbose(logging.DEBUG):
            traceback.print_exception(error)
        print(f"burrscan: {error}", file=sys.stderr)
        return 2
    except BrokenPipeError:  # the reader of our output has gone, as with `| head`
        sys.stderr.close()
        return 0
    except KeyboardInterrupt:
        print("\nburrscan: interrupted", file=sys.stderr)
        return 130
