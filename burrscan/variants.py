"""Variants: a stage by a short name or by ``"module:function"``, with parameters."""

from __future__ import annotations

import difflib
import importlib
import inspect
import json
import typing
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import pydantic

from burrscan.errors import InputError

_SHIPPED_ONLY: ContextVar[str] = ContextVar("shipped_only", default="")

_SHOWN = 60
"""Characters of a value that a message shows."""
MOST_KNOWN = 30
"""More words than these are no help in a message."""


def suggest(word: str, known: list[str]) -> str:
    """A closing phrase for an error message: the nearest known word, or those there are."""
    near = difflib.get_close_matches(word, known, n=1)
    if near:
        return f"did you mean '{near[0]}'?"
    more = f" and {len(known) - MOST_KNOWN} more" if len(known) > MOST_KNOWN else ""
    return f"known: {', '.join(sorted(known)[:MOST_KNOWN])}{more}"


@contextmanager
def shipped_only(source: str, *, trusted: bool = False) -> Iterator[None]:
    """Refuse, in the block, to import anyone's code by its name: data may name what is shipped, no more.

    Parameters
    ----------
    source
        The data that names it, for the message.
    trusted
        The user has said that this data may; then nothing is refused.

    """
    token = _SHIPPED_ONLY.set("" if trusted else source)
    try:
        yield
    finally:
        _SHIPPED_ONLY.reset(token)


def untrusted() -> str:
    """What :func:`shipped_only` keeps from naming code, and from having addresses called; or empty."""
    return _SHIPPED_ONLY.get()


def resolve(name: str, methods: Mapping[str, str], *, stage: str) -> Callable[..., Any]:
    """Find the function behind a variant's name.

    Parameters
    ----------
    name
        A key of ``methods``, or ``"module:function"`` of anyone's package.
    methods
        Short name to ``"module:function"``.
    stage
        What the function is for, for the message.

    Raises
    ------
    InputError
        When there is no such name, module or function, or in :func:`shipped_only` none of that name.

    """
    path = methods.get(name, name)
    if ":" not in path:
        raise InputError(f"unknown {stage} '{name}': {suggest(name, list(methods))} (or 'module:function')")
    function = _imported(path, what=stage) if name in methods else attribute(path, what=stage)
    if not callable(function):
        raise InputError(f"{stage} '{name}': this is no function but {type(function).__name__}")
    return function  # type: ignore[no-any-return]


def attribute(path: str, *, what: str) -> Any:
    """What stands behind ``"module:attribute"``.

    Parameters
    ----------
    path
        Of anyone's package.
    what
        What it is for, for the message.

    Raises
    ------
    InputError
        When there is no such module or attribute; in :func:`shipped_only` always.

    """
    if source := _SHIPPED_ONLY.get():
        raise InputError(
            f"{source}: names code, {what} '{path}', which data may not; "
            "if you trust whoever made it, say --trust"
        )
    return _imported(path, what=what)


def _imported(path: str, *, what: str) -> Any:
    module_name, _, name = path.partition(":")
    try:
        module = importlib.import_module(module_name)
    except ModuleNotFoundError as error:
        raise InputError(
            f"{what} '{path}': {error}; is the package installed, and is the name right?"
        ) from error
    except (ImportError, ValueError) as error:  # a module that breaks, or no name of one
        raise InputError(f"{what} '{path}': cannot be imported: {error}") from error
    if not hasattr(module, name):
        public = [key for key in vars(module) if not key.startswith("_")]
        raise InputError(f"{what} '{path}': no '{name}' in {module_name}; {suggest(name, public)}")
    return getattr(module, name)


def check_parameters(function: Callable[..., Any], parameters: Mapping[str, Any], *, stage: str) -> None:
    """Refuse parameters that ``function`` does not take, and values of another kind than it says.

    Raises
    ------
    InputError
        Naming the first unknown parameter and the nearest known one, or the first value of another kind; for
        a function without a signature.

    """
    signature = _signature(function, stage)
    if any(p.kind is p.VAR_KEYWORD for p in signature.parameters.values()):
        return
    known = [p.name for p in signature.parameters.values() if p.kind is p.KEYWORD_ONLY]
    for key in parameters:
        if key not in known:
            raise InputError(f"{stage}: unknown parameter '{key}': {suggest(key, known)}")
    for key, value in parameters.items():
        _refuse_another_kind(function, key, value, f"{stage}: parameter '{key}'")


def _as_json(value: Any) -> str:
    """A value as documents have them, as JSON; empty for arrays and objects, which are the caller's own."""
    try:
        return json.dumps(value)
    except (TypeError, ValueError):
        return ""


def _kind(function: Callable[..., Any], name: str) -> pydantic.TypeAdapter[Any] | None:
    """What a keyword of a function must be, where its annotation says so in terms of documents."""
    try:
        return pydantic.TypeAdapter(typing.get_type_hints(function)[name])
    except (KeyError, NameError, TypeError, AttributeError, pydantic.PydanticUserError):
        return None  # none is there, or it names what only a type checker knows, or arrays and objects


def _refuse_another_kind(function: Callable[..., Any], name: str, value: Any, where: str) -> None:
    text = _as_json(value)
    kind = _kind(function, name) if text else None
    if kind is None:
        return
    try:
        kind.validate_json(text, strict=True)  # in JSON a list is a tuple
    except pydantic.ValidationError as error:
        said = error.errors()[0]["msg"]
        raise InputError(f"{where}: {said[0].lower()}{said[1:]}, not {text[:_SHOWN]}") from error


def check_call(
    function: Callable[..., Any],
    places: Sequence[str],
    names: Sequence[str],
    parameters: Mapping[str, Any],
    *,
    stage: str,
) -> None:
    """Refuse a function that cannot be called as its stage will call it, before anything runs.

    Parameters
    ----------
    function
        Anyone's.
    places, names
        What it is given by place, and by name.
    parameters
        What the user gives it by name, besides.
    stage
        For the message.

    Raises
    ------
    InputError
        Naming the call, what of it does not fit, and the signature found.

    """
    signature = _signature(function, stage)
    try:
        signature.bind(*places, **dict.fromkeys(names), **parameters)
    except TypeError as error:
        call = ", ".join([*places, *(f"{name}=..." for name in (*names, *parameters))])
        raise InputError(f"{stage}: cannot be called as ({call}): {error}; it is {signature}") from error


def takes(function: Callable[..., Any], name: str) -> bool:
    """Whether a function has a parameter of that name that can be given by name."""
    return name in _signature(function, "method").parameters


def _signature(function: Callable[..., Any], stage: str) -> inspect.Signature:
    try:
        return inspect.signature(function)
    except (TypeError, ValueError) as error:  # compiled ones may state none
        raise InputError(f"{stage}: its signature cannot be read; wrap it in a Python function") from error
