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
_OBJ_CORNERS = 3
"""Coordinates of a vertex, and the fewest corners of a face."""
_FACES = re.compile(rb"(?m)^[ \t]*f([ \t].*)$")
_SHORT = re.compile(rb"(?m)^[ \t]*([vf])(?:[ \t]+[^\s#]+){0,2}[ \t]*(?:#.*)?\r?$")
"""A vertex of fewer than three coordinates, or a face of fewer corners."""
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
    return io.BytesIO(_ply(data, path) if kind == ".ply" else _obj(data, path))


def _ascii(text: bytes) -> bytes:
    try:
        text.decode("utf-8")
    except UnicodeDecodeError:
        return text.decode("latin-1").encode("ascii", "replace")
    return text


def _obj(data: bytes, path: Path) -> bytes:
    """A text of whole vertices and faces; where no line feed ends it, its faces have their vertices.

    An OBJ announces nothing. One that was cut off ends within a line, as a rule, or lacks vertices that it
    names. A number that lost its last digits is a number: that is not seen.
    """
    text = _ascii(data)
    if short := _SHORT.search(text):
        what = "vertex" if short[1] == b"v" else "face"
        number = text.count(b"\n", 0, short.end()) + 1
        raise InputError(
            f"{path}: is cut off or damaged: line {number} is a {what} of fewer than three numbers; save or "
            "copy it again"
        )
    if text.endswith((b"\n", b"\r")) or not text.strip():
        return text
    last = text.splitlines()[-1].split(b"#")[0].split()
    if last[:1] == [b"v"] and not (len(last) >= _OBJ_CORNERS + 1 and all(map(_is_number, last[1:]))):
        raise InputError(f"{path}: is cut off within its last line, a vertex; save or copy it again")
    if last[:1] == [b"f"] and not (len(last) >= _OBJ_CORNERS + 1 and all(map(_is_corner, last[1:]))):
        raise InputError(f"{path}: is cut off within its last line, a face; save or copy it again")
    there = len(re.findall(rb"(?m)^[ \t]*v[ \t]", text))
    named = max((int(n) for n in re.findall(rb"[ \t]([0-9]+)", b"\n".join(_FACES.findall(text)))), default=0)
    if named > there:
        raise InputError(
            f"{path}: is cut off: its faces name vertex {named}, it has {there}; save or copy it again"
        )
    return text


def _is_number(word: bytes) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _is_corner(word: bytes) -> bool:
    """Whether a word names a vertex, with its texture and normal or without: ``7``, ``7/1``, ``7//3``."""
    return re.fullmatch(rb"-?\d+(/-?\d+|/-?\d*/-?\d+)?", word) is not None


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
