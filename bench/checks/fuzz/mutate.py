"""Damage: to bytes of any file, and to values anywhere in a document."""

from __future__ import annotations

import copy
import json
import random
from typing import Any

import cv2
import numpy as np

from burrscan.arrays import Image

ODD: tuple[Any, ...] = (
    None, True, -1, 0, 1e-300, 1e300, 10**400, -99999, float("nan"), float("inf"), "", "x" * 5000,
    "\x00\x1b[31m", "helper:go", "../../x", "café", [], {}, [[]], "nan", 2**31, 2**63,
)  # fmt: skip
"""What no field expects, or expects last."""

_SHORT = 64
"""Bytes changed at once, at most: a header or a few fields; longer damage is seen at once."""


def damaged_bytes(data: bytes, draw: random.Random) -> bytes:
    """A file cut, with bytes changed, taken out, doubled or put in; possibly empty."""
    kind, spot = draw.randrange(6), draw.randrange(len(data) + 1)
    length = draw.randrange(1, _SHORT)
    if kind == 0:
        return data[:spot]
    if kind == 1:
        return data[:spot] + draw.randbytes(length) + data[spot + length :]
    if kind == 2:
        return data[:spot] + data[spot + length :]
    if kind == 3:
        return data[:spot] + data[spot : spot + length] * draw.randrange(2, 5) + data[spot + length :]
    if kind == 4:
        return data[:spot] + draw.randbytes(length) + data[spot:]
    flipped = bytearray(data or b"\0")
    flipped[min(spot, len(flipped) - 1)] ^= 1 << draw.randrange(8)
    return bytes(flipped)


def damaged_json(data: bytes, draw: random.Random) -> bytes:
    """A JSON document with one value replaced, removed, doubled or under another key."""
    document = json.loads(data)
    places = list(_places(document))
    if not places:
        return damaged_bytes(data, draw)
    holder, key = draw.choice(places)
    kind = draw.randrange(4)
    if kind == 0:
        del holder[key]
    elif kind == 1 and isinstance(holder, dict):
        holder[f"{key}x"] = holder.pop(key)
    elif kind == 2 and isinstance(holder, list):
        holder.append(copy.deepcopy(holder[key]))
    else:
        holder[key] = copy.deepcopy(draw.choice(ODD))
    return json.dumps(document).encode()


def damaged_toml(data: bytes, draw: random.Random) -> bytes:
    """A TOML file with the value of one line replaced, or the line taken out."""
    lines = data.decode().splitlines()
    numbers = [number for number, line in enumerate(lines) if "=" in line]
    number = draw.choice(numbers)
    key = lines[number].partition("=")[0]
    odd = draw.choice(
        (
            "nan",
            "inf",
            "-1",
            "0",
            "1e-9",
            "1e300",
            '""',
            '"helper:go"',
            "[]",
            "{}",
            "16384",
            '"\\u0000"',
            "true",
        )
    )
    lines[number : number + 1] = [] if draw.random() < 0.2 else [f"{key}= {odd}"]
    return "\n".join(lines).encode()


def damaged_lines(data: bytes, draw: random.Random) -> bytes:
    """Documents a line each (JSON Lines) with a value of one line damaged."""
    lines = data.splitlines(keepends=True)
    number = draw.randrange(len(lines))
    lines[number] = damaged_json(lines[number], draw) + b"\n"
    return b"".join(lines)


def damaged_csv(data: bytes, draw: random.Random) -> bytes:
    """A table with a cell replaced, put in or taken out, in its head or below."""
    rows = [line.split(",") for line in data.decode().splitlines()]
    row = draw.choice(rows)
    place, odd = draw.randrange(len(row)), str(draw.choice(ODD))
    row[place : place + draw.randrange(2)] = [odd] * draw.randrange(2)
    return "\n".join(",".join(row) for row in rows).encode()


def damaged_picture(data: bytes, draw: random.Random) -> bytes:
    """A picture of another size, kind or depth, or with nothing to see."""
    image: Image = np.asarray(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED))
    noise = np.random.default_rng(draw.randrange(2**32))
    changed = draw.choice((
        lambda: image[: len(image) // 2],
        lambda: np.rot90(image),
        lambda: image[:1, :1],
        lambda: np.zeros_like(image),
        lambda: np.full_like(image, np.iinfo(image.dtype).max),
        lambda: image.astype(np.uint16) * 257,
        lambda: (image // 2).astype(np.uint8),
        lambda: np.stack([image] * 3, axis=-1),
        lambda: np.stack([image, image // 2, image // 3], axis=-1),
        lambda: noise.integers(0, int(image.max()) + 1, image.shape).astype(image.dtype),
        lambda: image[::-1],
        lambda: np.roll(image, 20, axis=1),
    ))()  # fmt: skip
    return bytes(cv2.imencode(".png", np.ascontiguousarray(changed))[1])


def _places(node: Any) -> Any:
    """Every holder and key of a document, depth first."""
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in list(items):
        yield node, key
        yield from _places(value)
