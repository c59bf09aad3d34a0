"""What a mesh file holds, fit to be parsed: whole by its header's count, its text in an encoding we know."""

from __future__ import annotations

import io
import re
from pathlib import Path

from burrscan.errors import InputError

_STL_HEAD, _STL_FACET = 84, 50
"""Bytes of a binary STL's header with its count, and of each facet."""
_SIZES = {"char": 1, "short": 2, "int": 4, "float": 4, "double": 8}
"""Bytes of PLY's types, by both spellings."""
_SIZES |= {f"u{name}": size for name, size in _SIZES.items()}
_SIZES |= {
    "int8": 1,
    "uint8": 1,
    "int16": 2,
    "uint16": 2,
    "int32": 4,
    "uint32": 4,
    "float32": 4,
    "float64": 8,
}
_END = re.compile(rb"(?m)^end_header\r?\n?")


def mesh_bytes(path: Path) -> io.BytesIO:
    """A PLY, STL or OBJ file for a parser that believes its header.

    Text that is not UTF-8, such as a Latin-1 comment, becomes ASCII with question marks. O(bytes).

    Raises
    ------
    InputError
        When the file ends before what its header announces.
    OSError
        When it cannot be read.

    """
    data = path.read_bytes()
    kind = path.suffix.lower()
    if kind == ".stl":
        return io.BytesIO(_stl(data, path))
    return io.BytesIO(_ply(data, path) if kind == ".ply" else _ascii(data))


def _ascii(text: bytes) -> bytes:
    try:
        text.decode("utf-8")
    except UnicodeDecodeError:
        return text.decode("latin-1").encode("ascii", "replace")
    return text


def _stl(data: bytes, path: Path) -> bytes:
    """A binary file without what follows its last facet; a text with its end."""
    announced = int.from_bytes(data[_STL_HEAD - 4 : _STL_HEAD], "little")
    length = _STL_HEAD + _STL_FACET * announced
    if len(data) == length >= _STL_HEAD:
        return data
    if data.lstrip()[:5].lower() == b"solid" and b"\0" not in data:
        if b"endsolid" not in data.lower():
            raise InputError(f"{path}: is cut off: no 'endsolid' at its end; save or copy it again")
        return _ascii(data)
    if len(data) < length or len(data) < _STL_HEAD:
        raise InputError(
            f"{path}: is cut off: {len(data)} of {length} bytes for {announced} triangles; "
            "save or copy it again"
        )
    return data[:length]


def _ply(data: bytes, path: Path) -> bytes:
    end = _END.search(data)
    if not data.startswith(b"ply") or end is None:
        raise InputError(f"{path}: cannot be read as PLY: no header, or one that is cut off")
    header, body = _ascii(data[: end.end()]), data[end.end() :]
    words = [line.split() for line in header.decode("ascii", "replace").splitlines()]
    text = ["format", "ascii"] in [line[:2] for line in words]
    announced, least = 0, 0
    for line in words:
        if line[:1] == ["element"]:
            if len(line) != 3 or not line[2].isdigit():
                raise InputError(f"{path}: '{' '.join(line)}' in its header says no number of elements")
            count = int(line[2])
            announced += count
        elif line[:1] == ["property"] and len(line) > 2 and announced:
            least += count * _SIZES.get(line[2] if line[1] == "list" else line[1], 1)
    there, needed = (
        (sum(1 for line in body.splitlines() if line.strip()), announced) if text else (len(body), least)
    )
    if there < needed:
        what = "lines" if text else "bytes"
        raise InputError(
            f"{path}: is cut off: {there} {what} after its header, {needed} needed at least for its "
            f"{announced} elements; save or copy it again"
        )
    return header + (_ascii(body) if text else body)
