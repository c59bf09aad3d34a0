"""Damage to files and folders themselves: missing, empty, of another kind, not to be read."""

from __future__ import annotations

import random
import shutil
from collections.abc import Callable
from pathlib import Path

Upset = Callable[[Path, random.Random], None]


def missing(path: Path, _: random.Random) -> None:
    """Take a file away, or a folder with all that is in it."""
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink()


def emptied(path: Path, _: random.Random) -> None:
    """Leave the name alone: an empty folder, or a file without a byte."""
    kind = path.is_dir()
    missing(path, _)
    (path.mkdir if kind else path.touch)()


def of_another_kind(path: Path, _: random.Random) -> None:
    """A folder where a file should be, or a file where a folder should be."""
    kind = path.is_dir()
    missing(path, _)
    (path.touch if kind else path.mkdir)()


def unreadable(path: Path, _: random.Random) -> None:
    """What nobody can open, root neither: a link to itself."""
    missing(path, _)
    path.symlink_to(path.name)


def one_missing(path: Path, draw: random.Random) -> None:
    """Take one file of a folder away; of a file, the file."""
    files = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else []
    missing(draw.choice(files) if files else path, draw)


def swapped(path: Path, draw: random.Random) -> None:
    """Give a file the bytes of another one of its folder."""
    files = sorted(p for p in (path if path.is_dir() else path.parent).rglob("*") if p.is_file())
    one, other = draw.choice(files), draw.choice(files)
    one.write_bytes(other.read_bytes())


UPSETS: tuple[Upset, ...] = (missing, emptied, of_another_kind, unreadable, one_missing, swapped)
"""All of them."""
