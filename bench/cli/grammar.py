"""How every subcommand is declared."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

Commands = Any
"""What ``add_subparsers`` returns; argparse keeps its type private."""


def command(
    commands: Commands,
    name: str,
    main: Callable[[argparse.Namespace], int],
    *,
    summary: str,
    details: str = "",
    examples: str = "",
) -> argparse.ArgumentParser:
    """Declare a subcommand: one line for the overview, more for its own help."""
    parser: argparse.ArgumentParser = commands.add_parser(
        name,
        help=summary,
        description=f"{summary[0].upper()}{summary[1:]}.{chr(10) * 2 + details if details else ''}",
        epilog=f"examples:\n{examples}" if examples else None,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(main=main)
    return parser


def positive(text: str) -> int:
    """A whole number above zero."""
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"{text} is not above zero")
    return number
