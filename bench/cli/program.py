"""The command line as a program: its grammar, and how a command that fails ends."""

from __future__ import annotations

import argparse
import importlib
import io
import logging
import os
import sys
import traceback
from collections.abc import Sequence
from contextlib import suppress
from importlib import metadata
from pathlib import Path

from bench.cli.grammar import Parser, add_verbosity, declare, trusted
from bench.cli.output import set_verbosity, verbose
from bench.cli.signals import answered
from bench.memory import keep_freed

COMMANDS = (
    "doctor", "run", "gather", "compare", "accept", "history", "report", "leaderboard", "suites", "show",
    "render", "scan", "calibrate", "merge", "detect", "cell", "paper", "completion",
)  # fmt: skip
"""Subcommands in the order of the help; each is a module of this package (:func:`declare`)."""

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

exit codes: 0 done, 1 a gate is broken (compare) or a burr is over the limit (detect --limit), 2 the input or
the machine cannot be used (the message says why), 3 an error of burrscan's own, 130 interrupted,
143 terminated"""


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
        declare(commands, name, importlib.import_module(f"bench.cli.{name}"))
    return top


def run_program(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; the exit code is returned. Packages in the current directory are found, last."""
    _speak_any_text()
    set_verbosity(0)  # what an earlier call in this process asked for is over
    with answered() as signals:
        try:
            code = _run(arguments)
        except KeyboardInterrupt:
            print(f"\nburrscan: {signals.said}", file=sys.stderr)
            return signals.code or 130
        except BrokenPipeError:  # the reader of our output has gone, as with `| head`
            _mute()
            return 0
        except Exception as error:  # noqa: BLE001 (never 1, which is a verdict; never a page of code)
            return _failed(error)
        return signals.code or code  # a library may have swallowed what the signal raised


def _run(arguments: Sequence[str] | None) -> int:
    keep_freed()
    logging.basicConfig(format="%(message)s")
    given = parser().parse_args(arguments)
    set_verbosity(given.verbosity)
    if (here := str(Path.cwd())) not in sys.path:
        sys.path.append(here)
    with trusted(given):
        code = int(given.main(given))
    sys.stdout.flush()  # a full disk behind it is noticed here, not when Python ends
    return code


def _failed(error: Exception) -> int:
    """Say in one line what went wrong; 2 where the input or the machine is the reason, else 3."""
    from burrscan.errors import InputError

    if verbose(logging.DEBUG):
        traceback.print_exception(error)
    if isinstance(error, InputError):
        said, code = str(error), 2
    elif isinstance(error, OSError):
        said, code = _of_system(error), 2
    elif isinstance(error, MemoryError):
        said, code = "out of memory; a smaller scene, mesh or number of workers needs less", 2
    else:
        first = (str(error).splitlines() or [""])[0]
        said, code = (
            f"an error of its own: {type(error).__name__}: {first} (-vv shows where; please report it)",
            3,
        )
    _end_of_output()
    print(f"burrscan: {said}", file=sys.stderr)
    return code


def _of_system(error: OSError) -> str:
    """What the system refused, and for which file."""
    names = [os.fsdecode(name) for name in (error.filename, error.filename2) if isinstance(name, str | bytes)]
    reason = error.strerror or str(error) or type(error).__name__
    return f"{names[-1]}: {reason}" if names else reason


def _end_of_output() -> None:
    """Let go of what cannot be written, so that Python does not complain of it when it ends."""
    try:
        sys.stdout.flush()
    except OSError:
        _mute()


def _mute() -> None:
    with suppress(OSError, ValueError):  # a stream that tests put there has no descriptor
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)


def _speak_any_text() -> None:
    """What the terminal's encoding lacks is written as an escape: results do not depend on the locale."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
