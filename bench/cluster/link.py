"""Reaching a scheduler, by its address or the file that it wrote."""

from __future__ import annotations

import time
from pathlib import Path

import dask
from dask.utils import parse_timedelta
from distributed import Client

from burrscan.errors import InputError

_PAUSE_S = 0.5
"""Between two attempts to reach a scheduler: short beside what starting one takes."""


def connect(scheduler: str, *, patience_s: float | None = None) -> Client:
    """A client of a scheduler, that of nobody else in this process.

    Parameters
    ----------
    scheduler
        An address such as ``tcp://10.0.0.5:8786`` or the path of a scheduler file.
    patience_s
        How long one that does not answer is asked again; by default what Dask's
        ``distributed.comm.timeouts.connect`` says.

    Raises
    ------
    InputError
        When nobody answers.

    """
    if patience_s is None:
        patience_s = parse_timedelta(dask.config.get("distributed.comm.timeouts.connect"))
    deadline = time.monotonic() + patience_s
    while True:
        left_s = max(deadline - time.monotonic(), _PAUSE_S)
        try:
            return _client(scheduler, left_s)
        except (OSError, ValueError, TypeError, KeyError) as error:  # a file that is being written, too
            if time.monotonic() + _PAUSE_S >= deadline:
                raise InputError(
                    f"{scheduler}: no Dask scheduler answers there ({_said(error)}); start one with "
                    f"'dask scheduler', or see whether the address is right"
                ) from error
            time.sleep(_PAUSE_S)


def _client(scheduler: str, timeout_s: float) -> Client:
    if "://" not in scheduler and (scheduler.endswith(".json") or Path(scheduler).is_file()):
        if not Path(scheduler).is_file():
            raise FileNotFoundError(2, "there is no such scheduler file", scheduler)
        return Client(scheduler_file=scheduler, timeout=timeout_s, set_as_default=False)
    return Client(scheduler, timeout=timeout_s, set_as_default=False)


def _said(error: Exception) -> str:
    return (str(error).splitlines() or [repr(error)])[0]
