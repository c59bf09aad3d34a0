"""Tables on a terminal."""

from __future__ import annotations

from collections.abc import Container, Iterable

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.measure import Measurement
from rich.table import Table


def plain_table(heads: Iterable[str], title: str = "", *, right: Container[str] = ()) -> Table:
    """A table without rows, with a line below its heads and no other; columns ``right`` end at the right."""
    table = Table(
        title=title or None, title_justify="left", box=SIMPLE_HEAD, pad_edge=False, collapse_padding=True
    )
    for head in heads:
        table.add_column(head, justify="right" if head in right else "left", no_wrap=True)
    return table


def print_table(table: Table) -> None:
    """Print a table in the width there is, no cell cut short.

    On a terminal too narrow for it cells are folded, and where even that does not fit every row becomes lines
    of ``head: cell``. In a file or a pipe it is as wide as it is.
    """
    console = Console()
    wide = console.options.update(max_width=1000)
    if not console.is_terminal:
        console.width = max(console.width, Measurement.get(console, wide, table).maximum)
    if Measurement.get(console, wide, table).maximum > console.width:
        for column in table.columns:
            column.no_wrap, column.overflow = False, "fold"
        if Measurement.get(console, wide, table).minimum > console.width:
            _print_rows(console, table)
            return
    console.print(table)


def _print_rows(console: Console, table: Table) -> None:
    cells = [list(column.cells) for column in table.columns]
    for row in zip(*cells, strict=True):
        for column, cell in zip(table.columns, row, strict=True):
            console.print(f"{column.header}: {cell}", soft_wrap=True, highlight=False)
        console.print()
