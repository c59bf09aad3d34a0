"""The command ``burrscan``. This file imports next to nothing: from its first line on Ctrl-C is answered."""

from __future__ import annotations

import sys
from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; the exit code is returned."""
    try:
        from bench.cli.program import run_program

        return run_program(arguments)
    except KeyboardInterrupt:
        print("\nburrscan: interrupted", file=sys.stderr)
        return 130
