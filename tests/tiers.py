"""What `make test` runs of a test with many parameters, and what it leaves to `make studies`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import pytest


def some_of(
    names: str | tuple[str, ...],
    values: Iterable[Any],
    *,
    first: int = 1,
    ids: Sequence[str] | Callable[[Any], str] | None = None,
) -> pytest.MarkDecorator:
    """Parametrise a test, as :func:`pytest.mark.parametrize` does; all but the first are studies.

    For what takes seconds a time, and of which one shows most of what all would.
    """
    each = [value if hasattr(value, "marks") else _param(value, names) for value in values]
    beyond = [one._replace(marks=(*one.marks, pytest.mark.study)) for one in each[first:]]
    return pytest.mark.parametrize(names, [*each[:first], *beyond], ids=ids)


def _param(value: Any, names: str | tuple[str, ...]) -> Any:
    several = not isinstance(names, str) or "," in names
    return pytest.param(*value) if several else pytest.param(value)
