"""How many threads the renderer may use."""

from __future__ import annotations

import os

from burrscan.errors import InputError

THREADS_VARIABLE = "BURRSCAN_THREADS"
"""Environment variable that limits the renderer's threads; a run sets it for its worker processes."""


def default_threads() -> int:
    """Threads for the renderer where none are asked for.

    Raises
    ------
    InputError
        When ``BURRSCAN_THREADS`` is not a positive whole number.

    """
    named = os.environ.get(THREADS_VARIABLE) or str(usable_cores())
    if not named.isdecimal() or int(named) < 1:
        raise InputError(f"{THREADS_VARIABLE}={named}: give a whole number of threads, 1 or more")
    return int(named)


def usable_cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
