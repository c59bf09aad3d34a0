"""What a command says: to people on a terminal, to programs as JSON, less or more as it is told."""

from __future__ import annotations

import contextlib
import logging
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

STANDARD_OUTPUT = Path("-")


def set_verbosity(level: int) -> None:
    """How much is said besides results: -1 errors only, 0 notes too, 1 what is done, 2 everything."""
    names = {-1: logging.ERROR, 0: logging.WARNING, 1: logging.INFO}
    logging.getLogger().setLevel(names.get(max(level, -1), logging.DEBUG))


def verbose(level: int = logging.INFO) -> bool:
    """Whether the user asked (``-v``) for messages of this level."""
    return logging.getLogger().level <= level


def note(text: str) -> None:
    """Say something besides the result, on stderr, unless ``-q``."""
    if verbose(logging.WARNING):
        print(text, file=sys.stderr)


@contextlib.contextmanager
def told(json_to: Path | None) -> Iterator[None]:
    """Where what is printed for people goes: to stderr while stdout is for JSON alone."""
    if json_to != STANDARD_OUTPUT:
        yield
        return
    with contextlib.redirect_stdout(sys.stderr):
        yield


@contextlib.contextmanager
def json_beside(path: Path | None, document: Any) -> Iterator[None]:
    """Write a document as JSON once the block, which writes other files, has ended well; None writes nothing.

    Where it cannot be written the block is never begun: of several files either all are written, or none.
    """
    if path is None or path == STANDARD_OUTPUT:
        yield
        if path is not None:
            write_json(path, document)
        return
    from burrscan.documents import json_text
    from burrscan.files import written_whole

    with written_whole(path) as beside:
        beside.write_text(json_text(document), "utf-8")
        yield


def write_json(path: Path, document: Any) -> None:
    """Write a document as JSON to a file, whole, or with ``-`` to standard output.

    JSON knows numbers that are finite; any other becomes null.
    """
    from burrscan.documents import json_text
    from burrscan.files import write_text

    if path == STANDARD_OUTPUT:
        sys.stdout.write(json_text(document))
        return
    write_text(path, json_text(document))
