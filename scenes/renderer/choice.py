"""Choosing the Mitsuba variant that this machine can really run, and switching it on."""

from __future__ import annotations

import functools
import importlib
import logging
import multiprocessing
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from types import ModuleType
from typing import Any, Literal

from burrscan.errors import InputError
from burrscan.variants import suggest
from scenes.renderer.libraries import PATH_VARIABLE, candidates
from scenes.renderer.probe import Probe, probe_cuda, probe_llvm

VARIANT_VARIABLE = "BURRSCAN_VARIANT"
"""Environment variable that names the variant to use, whatever else would run."""

THREADS_VARIABLE = "BURRSCAN_THREADS"
"""Environment variable that limits the renderer's threads; a run sets it for its worker processes."""

VARIANTS = ("cuda_ad_mono", "cuda_ad_rgb", "llvm_ad_mono", "llvm_ad_rgb", "scalar_rgb")

Channels = Literal["mono", "rgb"]

_LOG = logging.getLogger("burrscan.renderer")


@dataclass(frozen=True)
class Renderer:
    """The Mitsuba variant that this machine runs, and how that was found out."""

    variant: str
    llvm_path: str | None
    llvm_version: str | None
    reason: str
    probes: tuple[Probe, ...]

    @property
    def vectorised(self) -> bool:
        """Whether whole wavefronts of rays run at once, as the traced light transport needs."""
        return not self.variant.startswith("scalar")


def choose(*, channels: Channels = "mono") -> Renderer:
    """Choose CUDA if it works, else LLVM with the first library that works, else the scalar variant.

    Every library is tried in a process of its own, once: the outcome is remembered on disk by file, processor
    and versions. Mitsuba is not imported here.

    Parameters
    ----------
    channels
        ``"mono"`` for intensities, ``"rgb"`` for pictures to look at. Mitsuba has no scalar mono variant, so
        the fallback is ``scalar_rgb`` in both cases.

    Raises
    ------
    InputError
        When the environment variable ``BURRSCAN_VARIANT`` names a variant that is unknown or cannot run.

    """
    named = os.environ.get(VARIANT_VARIABLE)
    if named:
        return _named(named)
    probes = [probe_cuda()]
    if not probes[0].ran:
        probes += _probe_until_one_runs()
    return _best(probes, channels)


def activate(*, channels: Channels = "mono", threads: int | None = None) -> ModuleType:
    """Import Mitsuba with the chosen variant switched on.

    Parameters
    ----------
    channels
        As for :func:`choose`.
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
    renderer = choose(channels=channels)
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


def default_threads() -> int:
    """Threads for the renderer where none are asked for.

    Raises
    ------
    InputError
        When ``BURRSCAN_THREADS`` is not a positive whole number.

    """
    named = os.environ.get(THREADS_VARIABLE) or str(usable_cores())
    if not named.isdecimal() or int(named) < 1:
        raise InputError(f"{THREADS_VARIABLE}={named}: give a whole number of threads, 1 or more")
    return int(named)


def usable_cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _probe_until_one_runs() -> list[Probe]:
    probes = []
    for library in candidates():
        probes.append(probe_llvm(library))
        if probes[-1].ran:
            break
    return probes


def _best(probes: list[Probe], channels: Channels) -> Renderer:
    working = [probe for probe in probes if probe.ran]
    if not working:
        return Renderer("scalar_rgb", None, None, _why_scalar(probes), tuple(probes))
    best = working[0]
    variant = f"{best.backend}_ad_{channels}"
    if best.backend == "cuda":
        return Renderer(variant, None, None, "a CUDA device ran the representative kernel", tuple(probes))
    reason = f"LLVM {best.version} ran the representative kernel ({best.path})"
    return Renderer(variant, best.path, best.version, reason, tuple(probes))


def _why_scalar(probes: list[Probe]) -> str:
    failed = [
        f"LLVM {probe.version} {probe.verdict}".replace("  ", " ")
        for probe in probes
        if probe.backend == "llvm"
    ]
    found = ", ".join(failed) if failed else "no libLLVM found"
    return f"no CUDA, and no LLVM that works ({found}); 'burrscan doctor' says what to install"


def _named(variant: str) -> Renderer:
    """The variant of the user's wish, with the probe that it needs."""
    if variant not in VARIANTS:
        raise InputError(f"{VARIANT_VARIABLE}={variant}: {suggest(variant, list(VARIANTS))}")
    reason = f"{VARIANT_VARIABLE} asks for it"
    if variant.startswith("scalar"):
        return Renderer(variant, None, None, reason, ())
    probes = [probe_cuda()] if variant.startswith("cuda") else _probe_until_one_runs()
    if not any(probe.ran for probe in probes):
        ends = "; ".join(f"{probe.path or probe.backend}: {probe.verdict}" for probe in probes)
        raise InputError(f"{VARIANT_VARIABLE}={variant} cannot run here ({ends or 'no libLLVM found'})")
    if variant.startswith("cuda"):
        return Renderer(variant, None, None, reason, tuple(probes))
    return Renderer(variant, probes[-1].path, probes[-1].version, reason, tuple(probes))


@functools.cache
def _warn_once(message: str) -> None:
    if multiprocessing.parent_process() is None:  # the workers' parent says it for all of them
        _LOG.warning(message)
