"""Ctrl-C and SIGTERM: always answered, with the exit code 128 + the signal's number."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

_NAMES = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}
_IMPORT = "importlib._bootstrap"


class Terminated(KeyboardInterrupt):
    """SIGTERM arrived; whatever puts things in order for Ctrl-C does so for it."""


@dataclass
class Signals:
    """What has arrived so far: the last signal's number, 0 for none."""

    last: int = 0

    @property
    def code(self) -> int:
        """The exit code that the signal asks for; 0 where none came."""
        return 128 + self.last if self.last else 0

    @property
    def said(self) -> str:
        """What became of the program, in a word."""
        return _NAMES.get(signal.Signals(self.last), "interrupted") if self.last else "interrupted"


@contextmanager
def answered() -> Iterator[Signals]:
    """Answer signals in the block: by KeyboardInterrupt or :class:`Terminated`.

    While a module is being imported the program ends at once instead: libraries swallow an exception there,
    and nothing is half-done. Outside the main thread, where nobody can catch signals, nothing changes.
    """
    seen = Signals()
    if threading.current_thread() is not threading.main_thread():
        yield seen
        return

    def answer(number: int, frame: FrameType | None) -> None:
        seen.last = number
        if _importing(frame):
            os.write(2, f"\nburrscan: {seen.said}\n".encode())
            os._exit(seen.code)
        raise Terminated if number == signal.SIGTERM else KeyboardInterrupt

    before = {number: signal.signal(number, answer) for number in _NAMES}
    try:
        yield seen
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _importing(frame: FrameType | None) -> bool:
    """Whether Python's import system stands anywhere below."""
    while frame is not None:
        if _IMPORT in frame.f_code.co_filename:
            return True
        frame = frame.f_back
    return False
