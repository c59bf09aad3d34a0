"""How every subcommand is declared."""

from __future__ import annotations

import argparse
import difflib
import math
import re
import sys
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from types import ModuleType
from typing import Any, NoReturn

Commands = Any
"""What ``add_subparsers`` returns; argparse keeps its type private."""

_SHORTEST_MM, _LONGEST_MM = 1e-3, 1e4
"""Of the squares of a board: a micrometre, and ten metres."""
_FEWEST_CORNERS, _MOST_CORNERS = 3, 200
"""Inner corners a side: two do not tell a board's way round, hundreds are a slip."""


class Parser(argparse.ArgumentParser):
    """A parser that says what a mistyped command or option may have been."""

    def error(self, message: str) -> NoReturn:
        """End with 2, the usage, what is wrong, and the nearest words that there are."""
        wrong = re.search(r"invalid choice: '([^']*)'", message)
        if wrong:
            words = [word for action in actions_of(self) for word in action.choices or ()]
            message = f"{message.partition(' (')[0]}{_near(wrong[1], list(map(str, words)))}"
        elif message.startswith("unrecognized arguments:"):
            given = [word.partition("=")[0] for word in message.split()[2:] if word.startswith("-")]
            known = _options(self)
            for word in given:
                message += _owned(word, self) if word in known else _near(word, sorted(known))
        self.print_usage(sys.stderr)
        self.exit(2, f"{self.prog}: {message}\n")


def actions_of(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    """A parser's arguments and options, which argparse tells nobody."""
    return list(parser._actions)  # noqa: SLF001


def subcommands_of(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """The parsers of a parser's subcommands, by name."""
    tables = [action.choices for action in actions_of(parser) if isinstance(action.choices, dict)]
    return {name: each for table in tables for name, each in table.items()}


def _options(parser: argparse.ArgumentParser) -> set[str]:
    """Every option of a parser and of its subcommands: the top one is told of what a subcommand leaves."""
    inner = map(_options, subcommands_of(parser).values())
    return {option for action in actions_of(parser) for option in action.option_strings}.union(*inner)


def _owned(option: str, parser: argparse.ArgumentParser) -> str:
    """Of which subcommands an option is, for who gives it to another one."""
    owners = [name for name, each in subcommands_of(parser).items() if option in _options(each)]
    return f"; {option} is an option of {', '.join(map(repr, owners)) or f'{parser.prog!r} itself'}"


def _near(word: str, known: list[str]) -> str:
    near = difflib.get_close_matches(word, known, n=1)
    if near:
        return f"; did you mean {near[0]!r}?"
    return "" if word.startswith("-") else f"; known: {', '.join(known)}"


def declare(commands: Commands, name: str, module: ModuleType) -> None:
    """Declare a subcommand.

    Its module has ``SUMMARY``, a line for the overview, and may have ``DETAILS`` and ``EXAMPLES`` for its own
    help; ``options(parser)`` adds what it takes, ``main(given)`` does it and returns the exit code.
    """
    summary, details, examples = (getattr(module, key, "") for key in ("SUMMARY", "DETAILS", "EXAMPLES"))
    parser: argparse.ArgumentParser = commands.add_parser(
        name,
        help=summary,
        description=f"{summary[0].upper()}{summary[1:]}.{chr(10) * 2 + details if details else ''}",
        epilog=f"examples:\n{examples}" if examples else None,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(main=module.main, data=())
    add_verbosity(parser, default=argparse.SUPPRESS)
    module.options(parser)


def add_verbosity(parser: argparse.ArgumentParser, *, default: int | str) -> None:
    """``-q`` and ``-v``: before the command or after it."""
    parser.add_argument(
        "-q",
        "--quiet",
        action="store_const",
        const=-1,
        dest="verbosity",
        default=default,
        help="results only",
    )
    parser.add_argument(
        "-v", "--verbose", action="count", dest="verbosity", default=default, help="say more; -vv: everything"
    )


def add_trust(parser: argparse.ArgumentParser, data: str, *, of: Sequence[str] = ()) -> None:
    """``--trust``, for commands that read data which may name code.

    While the command runs nothing is imported that the data names which its arguments ``of`` are; without any
    it sees to that itself.
    """
    parser.set_defaults(data=tuple(of))
    parser.add_argument(
        "--trust", action="store_true", help=f"import the code that {data} names; else that is refused"
    )


def trusted(given: argparse.Namespace) -> AbstractContextManager[None]:
    """Where a command runs: what the data it is given names is imported where the user said ``--trust``."""
    named = [getattr(given, name) for name in given.data]
    if not named:
        return nullcontext()
    from burrscan.variants import shipped_only

    words = [str(word) for each in named for word in (each if isinstance(each, list) else [each])]
    return shipped_only(" ".join(words), trusted=given.trust)


def add_baselines(parser: argparse.ArgumentParser) -> None:
    """``--baselines DIR``."""
    parser.add_argument(
        "--baselines", metavar="DIR", type=Path, default=Path("reports/baselines"),
        help="folder of accepted runs (default: reports/baselines)",
    )  # fmt: skip


def add_json(parser: argparse.ArgumentParser, what: str) -> None:
    """``--json FILE``, for commands that print for people besides."""
    parser.add_argument(
        "--json", metavar="FILE", type=Path, help=f"write {what} as JSON; - is standard output"
    )


def add_json_instead(parser: argparse.ArgumentParser, what: str) -> None:
    """``--json [FILE]``, for commands that print either for people or for programs."""
    parser.add_argument(
        "--json", metavar="FILE", type=Path, nargs="?", const=Path("-"),
        help=f"{what} as JSON; to standard output without a FILE or with -",
    )  # fmt: skip


def positive(text: str) -> int:
    """A whole number above zero."""
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"{text} is not above zero")
    return number


def not_negative(text: str) -> int:
    """A whole number, zero or more."""
    number = int(text)
    if number < 0:
        raise argparse.ArgumentTypeError(f"{text} is below zero")
    return number


def side_mm(text: str) -> float:
    """The side of a square: what is shorter or longer than any is is damaged, or another unit's."""
    length = length_mm(text)
    if not _SHORTEST_MM <= length <= _LONGEST_MM:
        raise argparse.ArgumentTypeError(f"{text} is no side of {_SHORTEST_MM:g} to {_LONGEST_MM:g} mm")
    return length


def corners(text: str) -> tuple[int, int]:
    """The inner corners of a chessboard, such as ``10x7``."""
    columns, rows = raster(text)
    if not (min(columns, rows) >= _FEWEST_CORNERS and max(columns, rows) <= _MOST_CORNERS):
        raise argparse.ArgumentTypeError(
            f"{text} is no chessboard: {_FEWEST_CORNERS} to {_MOST_CORNERS} inner corners along each side"
        )
    return columns, rows


def length_mm(text: str) -> float:
    """A finite length of zero or more."""
    length = float(text)
    if not (math.isfinite(length) and length >= 0.0):
        raise argparse.ArgumentTypeError(f"{text} is no length in mm")
    return length


def add_inspection_options(parser: argparse.ArgumentParser) -> None:
    """The options of everything that inspects a surface."""
    parser.add_argument("--axis", metavar="METHOD", default="profile", help="a short name or module:function")
    parser.add_argument(
        "--limit", metavar="MM", type=length_mm, help="height up to which a burr is permitted"
    )
    add_json(parser, "everything found")
    parser.add_argument("--ply", metavar="FILE", type=Path, help="write the mesh with its deviations as PLY")


def raster(text: str) -> tuple[int, int]:
    """A size such as ``1024x768``: width, then height."""
    width, cross, height = text.lower().replace("×", "x").partition("x")
    if not cross:
        raise argparse.ArgumentTypeError(f"{text} is no size such as 1024x768")
    return positive(width), positive(height)
