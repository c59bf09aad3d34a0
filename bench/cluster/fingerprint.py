"""What driver and workers must agree in, so that a record does not depend on who made it."""

from __future__ import annotations

import functools
import hashlib
import importlib
import importlib.util
import platform
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from bench.run.provenance import code_digest, versions
from bench.score.metrics import METRICS
from bench.suites.identity import content_hash
from bench.suites.suite import Suite, Variant
from bench.suites.variants import stages_of
from scenes.renderer import choose

Fingerprint = Mapping[str, str]
"""What it is about, to what it is."""


def fingerprint(modules: Sequence[str], *, renders: bool) -> dict[str, str]:
    """Of this process.

    Parameters
    ----------
    modules
        Modules of the user's own that a run names.
    renders
        Whether the run renders, so that the renderer counts.

    """
    python = ".".join(platform.python_version_tuple()[:2])
    return {
        "python": python,
        **versions(),
        "metrics": content_hash({name: metric.version for name, metric in METRICS.items()})[:12],
        "burrscan's code": _code(),
        **{f"module {name}": _module(name) for name in modules},
        **({"renderer": choose().variant} if renders else {}),
    }


def modules_of(suite: Suite) -> tuple[str, ...]:
    """The modules that a suite names as ``module:attribute``, of metrics and of stages."""
    named = [*suite.metrics, *(method for variant in suite.variant for method in _methods(variant))]
    return tuple(sorted({name.partition(":")[0] for name in named if ":" in name}))


def difference(expected: Fingerprint, here: Fingerprint) -> str:
    """What makes ``here`` another than ``expected``, in words; empty where nothing does."""
    parts = [
        f"{what} {here.get(what, 'none')} (the run: {wanted})"
        for what, wanted in expected.items()
        if here.get(what) != wanted
    ]
    return f"it has {', '.join(parts)}" if parts else ""


def _methods(variant: Variant) -> Iterator[str]:
    stages = stages_of(variant)
    for kind in ("scan", "axis", "generatrix", "burrs"):
        stage = getattr(stages, kind)
        yield stage.method
        yield from (value for value in stage.parameters.values() if isinstance(value, str))


@functools.cache
def _code() -> str:
    """Once per process: what is loaded does not change with the files."""
    return code_digest("burrscan", "scenes", "bench")


def _module(name: str) -> str:
    """A module's text as a digest; it is not run for that, only the packages above it are."""
    try:
        spec = importlib.util.find_spec(name)
    except ImportError:
        return "none"
    if spec is None or spec.origin is None or not Path(spec.origin).is_file():
        return "none"
    return hashlib.sha256(Path(spec.origin).read_bytes()).hexdigest()[:12]
