"""Documents: TOML and JSON read into dataclasses, every error listed at once, and made fit for JSON."""

from __future__ import annotations

import dataclasses
import functools
import json
import math
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar

import pydantic

from burrscan.errors import InputError
from burrscan.variants import suggest

T = TypeVar("T")

_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff]")
"""All but tab and line feed, and halves of characters, which no encoding can write."""

STRICT = pydantic.ConfigDict(extra="forbid", arbitrary_types_allowed=True, allow_inf_nan=False)
"""For ``__pydantic_config__`` of dataclasses that documents are read into."""


def read_toml(path: Path) -> dict[str, Any]:
    """A TOML file as plain tables; :class:`InputError` says what is wrong with the file."""
    try:
        with path.open("rb") as file:
            return tomllib.load(file)
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such file") from error
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not TOML: {error}") from error


def read_json(path: Path) -> Any:
    """A JSON file as plain values; :class:`InputError` says what is wrong with the file."""
    try:
        return json.loads(path.read_text("utf-8"))
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such file") from error
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not JSON: {error}") from error


def build(cls: type[T], document: Mapping[str, Any], *, source: str) -> T:
    """Make a dataclass of a document.

    Parameters
    ----------
    cls
        A dataclass, whose fields may be dataclasses themselves.
    document
        Plain tables as TOML or JSON give them.
    source
        Where the document comes from, for the message.

    Raises
    ------
    InputError
        With one line per error: the dotted path, what is wrong, and a suggestion for an unknown key.

    """
    refuse(list(_unprintable(document)), source)
    try:
        adapter: pydantic.TypeAdapter[T] = _adapter(cls)  # type: ignore[arg-type]  # mypy: a class is no Hashable
        return adapter.validate_python(document)
    except pydantic.ValidationError as error:
        lines = [_line(cls, item) for item in error.errors()]
    refuse(lines, source)
    raise AssertionError("a validation error without errors")


def refuse(problems: list[str], source: str) -> None:
    """Raise one :class:`InputError` that lists all ``problems``, if there are any."""
    if problems:
        lines = "\n".join(f"  {problem}" for problem in problems)
        raise InputError(f"{source}: {len(problems)} problem(s)\n{lines}")


def problems_of(error: InputError) -> list[str]:
    """The lines of an error that lists several (see :func:`refuse`), or its one message."""
    head, *lines = str(error).split("\n")
    return [line.strip() for line in lines] if head.endswith("problem(s)") else [str(error)]


@functools.cache
def _adapter(cls: Any) -> pydantic.TypeAdapter[Any]:
    """Made once per class: making one takes much longer than using it."""
    return pydantic.TypeAdapter(cls)


def printable(text: str) -> str:
    """The text with control characters and halves of characters written as escapes; tabs and lines stay."""
    return _CONTROL.sub(lambda found: found[0].encode("unicode_escape").decode("ascii"), text)


def _unprintable(value: Any, where: str = "") -> Iterator[str]:
    """Texts and keys with control characters, which no terminal, page or file name should meet."""
    if isinstance(value, str):
        if wrong := _CONTROL.search(value):
            yield f"{where}: holds the control character U+{ord(wrong[0]):04X}; take it out"
    elif isinstance(value, Mapping):
        for key, item in value.items():
            yield from _unprintable(str(key), where or "a key")
            yield from _unprintable(item, f"{where}.{key}".lstrip("."))
    elif isinstance(value, list | tuple):
        for number, item in enumerate(value):
            yield from _unprintable(item, f"{where}.{number}".lstrip("."))


def _line(cls: type[Any], error: Any) -> str:
    where = ".".join(str(part) for part in error["loc"])
    if error["type"] in {"extra_forbidden", "unexpected_keyword_argument"}:
        return f"{where}: unknown key; {suggest(str(error['loc'][-1]), _known_keys(cls))}"
    given = "" if error["type"] == "missing" else f" (got {error['input']!r})"
    return f"{where}: {error['msg'].lower()}{given}"


def _known_keys(cls: type[Any]) -> list[str]:
    """Every key that the document may hold at any depth, for suggestions."""
    keys: set[str] = set()
    pending: list[Any] = [cls]
    seen: set[Any] = set()
    while pending:
        item = pending.pop()
        if item in seen:
            continue
        seen.add(item)
        pending.extend(getattr(item, "__args__", ()))
        if dataclasses.is_dataclass(item) and isinstance(item, type):
            adapter_hints = pydantic.TypeAdapter(item).json_schema().get("$defs", {})
            keys.update(field.name for field in dataclasses.fields(item))
            for definition in adapter_hints.values():
                keys.update(definition.get("properties", {}))
    return sorted(keys)


def json_text(document: Any) -> str:
    """A document as JSON for people and programs; JSON knows finite numbers, any other becomes null."""
    return json.dumps(finite(document), indent=1, allow_nan=False) + "\n"


def finite(value: Any) -> Any:
    """A document with null for every number that is not finite."""
    if isinstance(value, Mapping):
        return {str(key): finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
