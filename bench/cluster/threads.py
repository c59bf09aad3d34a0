"""Threads of a worker that somebody else started."""

from __future__ import annotations

import os

from bench.run.crew import SINGLE_THREADED
from scenes.renderer import THREADS_VARIABLE


def limit_threads(threads: int) -> str:
    """Hold a worker's renderer and kernels to its share; see whether BLAS is held to one thread.

    Sums must not depend on the number of threads. BLAS reads its variables when numpy is loaded, which Dask
    does first of all; its nanny sets them before that.

    Returns
    -------
    str
        Why this worker's sums would depend on it, or nothing.

    """
    for name in ("NUMBA_NUM_THREADS", THREADS_VARIABLE):
        os.environ.setdefault(name, str(threads))
    free = [name for name in SINGLE_THREADED if os.environ.get(name) != "1"]
    return f"its BLAS is not held to one thread; start it with {'=1 '.join(free)}=1" if free else ""
