"""Tables over synthetic scans, no rendering.

``python -m bench.synthetic axis``, ``bluff``, ``burrs`` or ``clean``.
"""

from __future__ import annotations

import argparse

from bench.synthetic import axis_command, bluff_command, burr_command, clean_command
from burrscan.errors import InputError

_COMMANDS = {"axis": axis_command, "bluff": bluff_command, "burrs": burr_command, "clean": clean_command}


def main() -> None:
    """Run the command named, with its options."""
    parser = argparse.ArgumentParser(prog="python -m bench.synthetic", description=__doc__)
    commands = parser.add_subparsers(required=True, metavar="|".join(_COMMANDS))
    for name, module in _COMMANDS.items():
        command = commands.add_parser(
            name, description=module.__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
        )
        module.add_options(command)
        command.set_defaults(run=module.run)
    given = parser.parse_args()
    try:
        given.run(given)
    except (InputError, OSError) as error:
        parser.exit(2, f"{parser.prog}: {error}\n")


if __name__ == "__main__":
    main()
