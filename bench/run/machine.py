"""Telling the machine's failures from an algorithm's: a full disk is no result of anything."""

from __future__ import annotations

import errno
import re

from bench.run.records import Failure

_CODES = frozenset(
    {
        errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EACCES, errno.EPERM, errno.EIO,
        errno.ENOMEM, errno.EMFILE, errno.ENFILE, errno.ESTALE, errno.EAGAIN,
    }
)  # fmt: skip
"""No space, no permission, a failing disk, no memory, no descriptors: nothing that a method does."""


_SAID = re.compile(r"(?m)^(?:[\w.]+: \[Errno (?P<code>\d+)\] (?P<reason>.*)|(?:[\w.]+\.)?MemoryError\b.*)$")
"""How Python words such an error, first in a record's error or last of a traceback's parts."""


def said_of_the_machine(failure: Failure) -> str:
    """What of the machine made a failure that was recorded before such were told apart; else empty.

    Older versions recorded a full disk as if the method had failed.
    """
    for said in _SAID.finditer(f"{failure.error}\n{failure.traceback}"):
        if said["code"] is None:
            return "out of memory"
        if int(said["code"]) in _CODES:
            return said["reason"]
    return ""


def of_the_machine(error: BaseException) -> str:
    """What of the machine made an error, in one line; empty where the machine did not.

    What an error was raised from, or while handling, counts as well.
    """
    seen: set[int] = set()
    found: BaseException | None = error
    while found is not None and id(found) not in seen:
        seen.add(id(found))
        if isinstance(found, MemoryError):
            return "out of memory"
        if isinstance(found, OSError) and found.errno in _CODES:
            return f"{found.filename}: {found.strerror}" if found.filename else str(found.strerror)
        found = found.__cause__ or found.__context__
    return ""
