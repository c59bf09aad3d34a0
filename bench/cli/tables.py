"""Tables on a terminal."""

from __future__ import annotations

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.measure import Measurement
from rich.table import Table


def plain_table(title: str = "") -> Table:
    """An empty table with a line below its heads and no other."""
    return Table(
        title=title or None, title_justify="left", box=SIMPLE_HEAD, pad_edge=False, collapse_padding=True
    )


def print_table(table: Table) -> None:
    """Print a table as wide as it is: cells cut short say nothing, long lines can be scrolled."""
    console = Console()
    needed = Measurement.get(console, console.options.update(max_width=1000), table).maximum
    console.width = max(console.width, needed)
    console.print(table)
