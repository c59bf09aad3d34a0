"""From a suite to its cases: every scene point with every seed, ready to be simulated."""

from __future__ import annotations

import fnmatch
import hashlib
import itertools
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from bench.suites.case import Case
from bench.suites.identity import content_hash, stream
from bench.suites.paths import override
from bench.suites.sources import HASHES
from bench.suites.suite import Suite, problems_of, refuse
from burrscan.errors import InputError
from burrscan.variants import suggest

POINT = "point"
"""The parameter that numbers the points of a random design."""

_LONGEST_ID = 160


def expand(suite: Suite, *, seed: int = 0) -> tuple[Case, ...]:
    """All cases of a suite, in canonical order: the grid, its last path fastest; points drawn; seeds.

    Parameters
    ----------
    suite
        What to expand.
    seed
        The run's seed: another one gives a new realisation of the whole suite.

    Raises
    ------
    burrscan.errors.InputError
        With everything that does not fit the scene.

    """
    cases, problems = [], dict[str, None]()
    for (point, names), case_seed in itertools.product(_points(suite), suite.seeds):
        try:
            cases.append(_case(suite, point, names, case_seed, seed))
        except InputError as error:
            problems |= dict.fromkeys(problems_of(error))  # many cases share them
    refuse(list(problems), suite.source)
    return tuple(cases)


def chosen(cases: Sequence[Case], pattern: str) -> tuple[Case, ...]:
    """The cases whose id matches a pattern with ``*`` and ``?``, the case of letters included.

    Raises
    ------
    burrscan.errors.InputError
        When none does.

    """
    found = tuple(case for case in cases if fnmatch.fnmatchcase(case.id, pattern))
    if not found:
        raise InputError(f"no case matches '{pattern}': {suggest(pattern, [case.id for case in cases])}")
    return found


def label(value: Any) -> str | float | int | bool:
    """A swept value as people read it: plain values as they are, tables by their name, else by content."""
    if isinstance(value, str | int | float | bool):
        return value
    if isinstance(value, Mapping) and isinstance(value.get("name"), str):
        return str(value["name"])
    if isinstance(value, list | tuple) and len(value) <= 4 and all(isinstance(v, int | float) for v in value):
        return "x".join(f"{v:g}" for v in value)
    return content_hash(value)[:6]


def short(path: str | Path) -> str:
    """A path of a file as its stem; anything else as it is."""
    text = str(path)
    return Path(text).stem if text.endswith(".toml") else text


def _points(suite: Suite) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """Path to value of every scene point, and what distinguishes it: points drawn also have a number."""
    grid = [dict(zip(suite.sweep, v, strict=True)) for v in itertools.product(*suite.sweep.values())]
    if suite.random is None:
        return [(point, _labels(point)) for point in grid]
    drawn = suite.random.values()
    digits = len(str(len(drawn) - 1))
    return [
        ({**point, **values}, {**_labels(point), POINT: f"{number:0{digits}d}", **_labels(values)})
        for point in grid
        for number, values in enumerate(drawn)
    ]


def _labels(point: Mapping[str, Any]) -> dict[str, Any]:
    return {path: label(value) for path, value in point.items()}


def _case(suite: Suite, point: Mapping[str, Any], names: Mapping[str, Any], seed: int, run_seed: int) -> Case:
    document = dict(suite.scene)
    for path, value in point.items():
        document = override(document, path, value)
    identity = content_hash({"scene": document, "seed": seed, "run": run_seed})
    for path, (low, high) in suite.jitter.items():
        document = override(document, path, float(stream(identity, path).uniform(low, high)))
    parameters = {**names, "seed": seed}
    return Case(_id(parameters), parameters, seed, document, HASHES[suite.source](document), identity)


def _id(parameters: Mapping[str, Any]) -> str:
    text = ",".join(f"{key}={_text(value)}" for key, value in parameters.items())
    safe = re.sub(r"[^A-Za-z0-9._=,+-]", "_", text)
    if len(safe) <= _LONGEST_ID:
        return safe
    return f"{safe[:_LONGEST_ID]}-{hashlib.sha256(text.encode()).hexdigest()[:8]}"


def _text(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else short(str(value))
