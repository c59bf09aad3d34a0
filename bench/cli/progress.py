"""Showing how far a run is: a bar with the time left on a terminal, a line per case elsewhere."""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

from bench.cli.output import verbose
from bench.run.runner import Progress


@contextmanager
def shown(title: str) -> Iterator[Callable[[Progress], None]]:
    """Yield the callback that shows progress on stderr."""
    if not verbose(logging.WARNING):
        yield lambda _: None
        return
    console = Console(stderr=True)
    if not console.is_terminal:
        start = time.monotonic()
        yield lambda state: _line(title, state, time.monotonic() - start)
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with Bar(*columns, console=console, speed_estimate_period=3600.0) as bar:
        yield partial(_draw, bar, title, time.monotonic())


def pace(state: Progress, elapsed_s: float) -> str:
    """How many are at work, and how fast; nothing before the first case."""
    done = state.done - state.before
    if not done or not state.workers:
        return ""
    workers = f"{state.workers} worker{'s' if state.workers > 1 else ''}"
    return f"{workers}, {60.0 * done / max(elapsed_s, 1e-9):.3g} cases/min"


def _draw(bar: Bar, title: str, start: float, state: Progress) -> None:
    """Draw the bar; it starts with what was done before, which tells nothing of the time left."""
    description = f"{title} [red]{state.failed} failed[/]" if state.failed else title
    if said := pace(state, time.monotonic() - start):
        description += f" ({said})"
    if not bar.tasks:
        bar.add_task(description, total=state.total, completed=state.done)
    else:
        bar.update(bar.tasks[0].id, completed=state.done, description=description)


def _line(title: str, state: Progress, elapsed_s: float) -> None:
    failed = f", {state.failed} failed" if state.failed else ""
    said = pace(state, elapsed_s)
    if said:
        left_s = (state.total - state.done) * elapsed_s / (state.done - state.before)
        said = f" [{said}, {left_s / 60.0:.1f} min left]"
    print(f"{title}: {state.done}/{state.total}{failed} {state.case}{said}", file=sys.stderr, flush=True)
