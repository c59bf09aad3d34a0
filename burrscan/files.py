"""Writing files whole or not at all, and writing into what is no file: a device, a pipe."""

from __future__ import annotations

import os
import re
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_STANDARD = {"/dev/stdout": 1, "/dev/stderr": 2}
"""Descriptors of POSIX by the names of their devices."""
_DESCRIPTOR = re.compile(r"/(?:dev|proc/self)/fd/(\d+)")
_KEPT_OF_NAME = 40
"""Characters of a file's name in that of its temporary: at most 160 of the 255 bytes that a name may have."""


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """Yield a temporary path beside ``path``; sync it and rename it into place if the block ends well.

    What a symbolic link points to is replaced, not the link. A device, a pipe, a socket or a descriptor such
    as ``/dev/stdout`` is never replaced: it is written into, after the block.

    Raises
    ------
    OSError
        When the file cannot be written; then ``path`` is what it was, and nothing lies beside it.

    """
    if _is_stream(path):
        with tempfile.TemporaryDirectory(prefix="burrscan-") as folder:
            made = Path(folder) / f"out{path.suffix}"
            yield made
            _pour(made, path)
        return
    target = _linked(path) if path.is_symlink() else path
    if target.is_dir():
        raise IsADirectoryError(21, "is a folder; name a file", str(path))
    target.parent.mkdir(parents=True, exist_ok=True)
    mark = f"{os.getpid()}-{threading.get_ident()}"
    beside = target.with_name(f".{target.name[:_KEPT_OF_NAME]}.{mark}.tmp{target.suffix[:_KEPT_OF_NAME]}")
    try:
        yield beside
        _synced(beside)
        beside.replace(target)
        with suppress(OSError):  # not every file system syncs folders
            _synced(target.parent)
    finally:
        beside.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text in UTF-8 as :func:`written_whole` does."""
    with written_whole(path) as beside:
        beside.write_text(text, "utf-8")


def _linked(link: Path) -> Path:
    """What a symbolic link points to, there or not; links in a circle are an OSError."""
    with suppress(FileNotFoundError):
        link.stat()  # Python up to 3.12 raises RuntimeError for a circle, and later ones resolve it to itself
    return link.resolve()


def _is_stream(path: Path) -> bool:
    """Whether ``path`` is there and is neither a file nor a folder, or names an open descriptor."""
    return _descriptor(path) is not None or (path.exists() and not path.is_file() and not path.is_dir())


def _descriptor(path: Path) -> int | None:
    """The number of the open descriptor that a path names; its file, where it is one, is the shell's."""
    text = str(path)
    numbered = _DESCRIPTOR.fullmatch(text)
    return int(numbered[1]) if numbered else _STANDARD.get(text)


def _pour(made: Path, into: Path) -> None:
    number = _descriptor(into)
    sys.stdout.flush()
    with made.open("rb") as source, open(into if number is None else os.dup(number), "wb") as sink:  # noqa: PTH123 (a descriptor is no path)
        while block := source.read(1 << 20):
            sink.write(block)


def _synced(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
