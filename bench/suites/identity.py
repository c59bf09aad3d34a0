"""Content hashes, and the random streams that are spawned from them."""

from __future__ import annotations

import hashlib
import json
import math
import zlib
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from burrscan.documents import refuse


def canonical(document: Any) -> str:
    """The one JSON text of plain tables: sorted keys, no spaces, numbers as Python writes them.

    Raises
    ------
    burrscan.errors.InputError
        Naming every number that is not finite.

    """
    refuse([f"{path}: is not a finite number" for path in _not_finite(document)], "a scene")
    return json.dumps(document, sort_keys=True, separators=(",", ":"), allow_nan=False)


def _not_finite(node: Any, where: str = "") -> Iterator[str]:
    if isinstance(node, float) and not math.isfinite(node):
        yield where
    inner = list(node.items()) if isinstance(node, Mapping) else []
    for key, value in list(enumerate(node)) if isinstance(node, list | tuple) else inner:
        yield from _not_finite(value, f"{where}.{key}".lstrip("."))


def content_hash(document: Any) -> str:
    """SHA-256 of :func:`canonical`, as 64 hexadecimal digits."""
    return hashlib.sha256(canonical(document).encode()).hexdigest()


def stream(identity: str, purpose: str) -> np.random.Generator:
    """The random stream of one purpose within one identity; streams of different purposes are independent."""
    sequence = np.random.SeedSequence(int(identity, 16), spawn_key=(zlib.crc32(purpose.encode()),))
    return np.random.default_rng(sequence)


def entropy(identity: str) -> tuple[int, ...]:
    """An identity as eight 32-bit words, for code that seeds its own streams."""
    return tuple(int(identity[i : i + 8], 16) for i in range(0, 64, 8))
