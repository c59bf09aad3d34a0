"""Where a system keeps libLLVM, and which of its files are worth a probe."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

PATH_VARIABLE = "DRJIT_LIBLLVM_PATH"
"""Names a file; Dr.Jit reads it when its LLVM backend starts."""

_FOLDERS = (
    "/usr/lib/*-linux-gnu*",
    "/usr/lib/llvm-*/lib",
    "/usr/lib/llvm*/lib*",
    "/usr/lib/llvm/*/lib*",
    "/usr/lib64/llvm*/lib*",
    "/usr/lib64",
    "/usr/lib",
    "/usr/local/lib*",
    "/usr/local/opt/llvm*/lib",
    "/opt/homebrew/opt/llvm*/lib",
    "/opt/local/libexec/llvm-*/lib",
)
_NAME = re.compile(r"libLLVM(?:-(?P<before>\d+)\S*)?\.(?:so|dylib)(?:\.(?P<after>\d+)\S*)?|LLVM-C\.dll")


@dataclass(frozen=True)
class Library:
    """A file that may be a usable libLLVM."""

    path: Path
    major: int
    """Major version by the file's name, 0 when the name does not say."""


def candidates() -> list[Library]:
    """The user's own choice first, then the system's, newest first, each file once whatever its links."""
    named = os.environ.get(PATH_VARIABLE)
    first = [Library(Path(named), _major(Path(named)))] if named else []
    found = sorted(system_libraries(_folders()), key=lambda library: (-library.major, str(library.path)))
    unique: dict[Path, Library] = {}
    for library in first + found:
        unique.setdefault(library.path.resolve(), library)
    return list(unique.values())


def system_libraries(folders: Iterable[Path]) -> list[Library]:
    """Every libLLVM of ``folders``, links resolved."""
    paths = {path.resolve() for folder in folders for path in _files(folder) if _NAME.fullmatch(path.name)}
    return [Library(path, _major(path)) for path in sorted(paths) if path.is_file()]


def _major(path: Path) -> int:
    match = _NAME.fullmatch(path.resolve().name)
    return int(match["before"] or match["after"] or 0) if match else 0


def _files(folder: Path) -> list[Path]:
    try:
        return list(folder.iterdir())
    except OSError:  # absent, or not ours to read
        return []


def _folders() -> Iterator[Path]:
    for prefix in (os.environ.get("CONDA_PREFIX"), sys.prefix):
        if prefix:
            yield Path(prefix) / "lib"
    for variable in ("LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH"):
        yield from (Path(part) for part in os.environ.get(variable, "").split(os.pathsep) if part)
    for pattern in _FOLDERS:
        yield from Path("/").glob(pattern.removeprefix("/"))
    if sys.platform == "win32":
        yield from (Path(part) for part in os.environ.get("PATH", "").split(os.pathsep) if part)
        yield Path("C:/Program Files/LLVM/bin")
