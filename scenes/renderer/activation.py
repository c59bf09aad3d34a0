"""Importing Mitsuba with the chosen variant switched on."""

from __future__ import annotations

import functools
import importlib
import logging
import multiprocessing
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from types import ModuleType
from typing import Any

from burrscan.errors import InputError
from scenes.renderer.choice import VARIANT_VARIABLE, Renderer, choose
from scenes.renderer.libraries import PATH_VARIABLE
from scenes.renderer.threads import default_threads

_LOG = logging.getLogger("burrscan.renderer")


def activate(*, threads: int | None = None) -> ModuleType:
    """Import Mitsuba with the chosen variant switched on.

    Parameters
    ----------
    threads
        Threads of the renderer; by default ``BURRSCAN_THREADS``, else as many as this process may use.
        Results do not depend on it.

    Returns
    -------
    module
        ``mitsuba``.

    Raises
    ------
    InputError
        As :func:`choose`; and when Mitsuba was imported before, with another library than the one that works.

    """
    renderer = choose()
    if not renderer.vectorised and not os.environ.get(VARIANT_VARIABLE):
        _warn_once(f"Rendering with {renderer.variant}, which is slow: {renderer.reason}")
    mitsuba, drjit = _imported(renderer)
    if mitsuba.variant() != renderer.variant:
        mitsuba.set_variant(renderer.variant)
    drjit.set_thread_count(threads or default_threads())
    return mitsuba  # type: ignore[no-any-return]


def _imported(renderer: Renderer) -> tuple[Any, Any]:
    """Mitsuba and Dr.Jit; Dr.Jit loads its LLVM when it is first imported, once for the whole process."""
    if renderer.llvm_path:
        os.environ[PATH_VARIABLE] = renderer.llvm_path
    with nullcontext() if renderer.vectorised else _native_silence():
        mitsuba, drjit = (importlib.import_module(name) for name in ("mitsuba", "drjit"))
    if renderer.llvm_version:
        loaded = ".".join(map(str, drjit.detail.llvm_version()))
        if loaded != renderer.llvm_version:
            raise InputError(
                f"Dr.Jit was imported with LLVM {loaded}, but {renderer.llvm_version} is what works here: "
                f"call scenes.renderer.activate() first, or set {PATH_VARIABLE}={renderer.llvm_path}"
            )
    return mitsuba, drjit


@contextmanager
def _native_silence() -> Iterator[None]:
    """Hold back what native code says on standard error: that there is no LLVM has been said already."""
    sys.stderr.flush()
    kept = os.dup(2)
    try:
        with open(os.devnull, "wb") as nowhere:  # noqa: PTH123 (a device)
            os.dup2(nowhere.fileno(), 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)


@functools.cache
def _warn_once(message: str) -> None:
    if multiprocessing.parent_process() is None:  # the workers' parent says it for all of them
        _LOG.warning(message)
