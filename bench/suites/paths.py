"""Dotted paths into plain tables, such as ``burr.height_mm`` or ``burr.0.height_mm``."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from typing import Any

from burrscan.errors import InputError


def override(document: Mapping[str, Any], path: str, value: Any) -> dict[str, Any]:
    """A copy of ``document`` with ``value`` at ``path``.

    A key that meets an array of tables goes to every one of them; an integer picks one. Tables that are
    missing on the way are made.

    Raises
    ------
    InputError
        When the path runs into a plain value, or an index is not there.

    """
    changed = copy.deepcopy(dict(document))
    _set(changed, path.split("."), value, path)
    return changed


def merge(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """``base`` with the tables of ``over`` laid over it, key by key; everything else is replaced."""
    merged = copy.deepcopy(dict(base))
    for key, value in over.items():
        both_tables = isinstance(value, Mapping) and isinstance(merged.get(key), Mapping)
        merged[key] = merge(merged[key], value) if both_tables else copy.deepcopy(value)
    return merged


def flatten(tables: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Every leaf of nested tables as (dotted path, value): ``[a] b = 1`` and ``"a.b" = 1`` are the same."""
    for key, value in tables.items():
        if isinstance(value, Mapping):
            yield from flatten(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def _set(node: Any, keys: list[str], value: Any, path: str) -> None:
    key, rest = keys[0], keys[1:]
    if isinstance(node, list):
        _set_in_array(node, keys, value, path)
    elif not isinstance(node, dict):
        raise InputError(f"'{path}': there is no table to hold '{key}', only the value {node!r}")
    elif rest:
        _set(node.setdefault(key, {}), rest, value, path)
    else:
        node[key] = copy.deepcopy(value)


def _set_in_array(node: list[Any], keys: list[str], value: Any, path: str) -> None:
    if not keys[0].isdigit():
        for item in node:
            _set(item, keys, value, path)
        return
    index = int(keys[0])
    if index >= len(node):
        raise InputError(f"'{path}': there is no item {index} in an array of {len(node)}")
    if len(keys) > 1:
        _set(node[index], keys[1:], value, path)
    else:
        node[index] = copy.deepcopy(value)
