"""From a suite to its cases: every scene point with every seed, ready to be simulated."""

from __future__ import annotations

import fnmatch
import hashlib
import itertools
import re
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, cast

from bench.suites.case import Case
from bench.suites.identity import content_hash, stream
from bench.suites.paths import override
from bench.suites.sources import HASHES
from bench.suites.suite import CONDITION, Suite
from burrscan.documents import problems_of, refuse
from burrscan.errors import InputError
from burrscan.variants import suggest

POINT = "point"
"""The parameter that numbers the points of a random design."""

_LONGEST_ID = 160
"""Characters of a case's name, which names files: 255 bytes are what a file system takes, and suffixes
follow."""
_MOST_WORDS = 5  # of a table without a name: more of them are no name
_HANDY_ID = 100  # beyond it values drawn are left to the case's parameters: its point's number names it
_Point = tuple[dict[str, Any], dict[str, Any]]
"""Dotted path to value; and what is said of it to people."""


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
    cases, problems = [], dict[str, str]()
    for (point, names), case_seed in itertools.product(_points(suite), suite.seeds):
        try:
            cases.append(_case(suite, point, names, case_seed, seed))
        except InputError as error:
            for problem in problems_of(error):  # many cases share them, but for the value they have
                problems.setdefault(problem.partition(" (got ")[0], problem)
    refuse(list(problems.values()), suite.source)
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
    """A swept value as people read it: plain values as they are, tables by their name or what they say."""
    if _plain(value):
        return cast("str | float | int | bool", value)
    if isinstance(value, Mapping) and isinstance(value.get("name"), str):
        return str(value["name"])
    if isinstance(value, Mapping) and 0 < len(value) <= _MOST_WORDS and all(map(_plain, value.values())):
        return "-".join(f"{v:g}" if isinstance(v, float) else str(v) for v in value.values())  # a finish
    if isinstance(value, list | tuple) and all(isinstance(v, Mapping) and "kind" in v for v in value):
        return "+".join(_kind(v) for v in value) or "none"  # burrs, blemishes
    if isinstance(value, list | tuple) and len(value) <= 4 and all(isinstance(v, int | float) for v in value):
        return "x".join(f"{v:g}" for v in value)
    return content_hash(value)[:6]


def _kind(table: Mapping[str, Any]) -> str:
    """A burr's kind, and its section where it is not the plain prism; a blemish's kind."""
    section = table.get("section", "triangle")
    return str(table["kind"]) if section == "triangle" else f"{table['kind']}-{section}"


def _plain(value: Any) -> bool:
    return isinstance(value, str | int | float | bool)


def short(path: str | Path) -> str:
    """A path of a file as its stem; anything else as it is."""
    text = str(path)
    return Path(text).stem if text.endswith(".toml") else text


def _points(suite: Suite) -> list[_Point]:
    """Every scene point: conditions, then the grid, then what is drawn, the last fastest."""
    none: list[_Point] = [({}, {})]
    parts = itertools.product(_conditions(suite) or none, _grid(suite), _drawn(suite) or none)
    return [
        (
            {p: v for point, _ in part for p, v in point.items()},
            {p: v for _, names in part for p, v in names.items()},
        )
        for part in parts
    ]


def _conditions(suite: Suite) -> list[_Point]:
    return [(dict(paths), {CONDITION: name}) for name, paths in suite.condition.items()]


def _grid(suite: Suite) -> list[_Point]:
    rows = itertools.product(*suite.sweep.values())
    points = [dict(zip(suite.sweep, values, strict=True)) for values in rows]
    return [(point, _labels(point)) for point in points]


def _drawn(suite: Suite) -> list[_Point]:
    """Points drawn have a number: their names must differ, however alike their values."""
    points = suite.random.values() if suite.random else []
    digits = len(str(len(points) - 1))
    return [(point, {POINT: f"{number:0{digits}d}", **_labels(point)}) for number, point in enumerate(points)]


def _labels(point: Mapping[str, Any]) -> dict[str, Any]:
    return {path: label(value) for path, value in point.items()}


def _case(suite: Suite, point: Mapping[str, Any], names: Mapping[str, Any], seed: int, run_seed: int) -> Case:
    document = dict(suite.scene)
    for path, value in sorted(point.items(), key=lambda item: item[0].count(".")):  # tables, then their keys
        document = _override(document, path, value)
    # what is asked of a cell is not of the world: whoever plans finds the same part, put down the same way
    world = {key: value for key, value in document.items() if key != "task"}
    identity = content_hash({"scene": world, "seed": seed, "run": run_seed})
    for path, (low, high) in suite.jitter.items():
        document = override(document, path, float(stream(identity, path).uniform(low, high)))
    parameters = {**names, "seed": seed}
    drawn = suite.random.draw if suite.random else ()
    return Case(_id(parameters, drawn), parameters, seed, document, HASHES[suite.source](document), identity)


def _override(document: dict[str, Any], path: str, value: Any) -> dict[str, Any]:
    if path.startswith("burr.") and "burr" not in document:
        raise InputError(f"'{path}': the scene has no burr of its own to set it in; give it a [[scene.burr]]")
    return override(document, path, value)


def _id(parameters: Mapping[str, Any], drawn: Collection[str]) -> str:
    text = _joined(parameters)
    if drawn and len(text) > _HANDY_ID:
        text = _joined({key: value for key, value in parameters.items() if key not in drawn})
    safe = re.sub(r"[^A-Za-z0-9._=,+-]", "_", text)
    if len(safe) <= _LONGEST_ID:
        return safe
    return f"{safe[:_LONGEST_ID]}-{hashlib.sha256(text.encode()).hexdigest()[:8]}"


def _joined(parameters: Mapping[str, Any]) -> str:
    return ",".join(f"{key}={_text(value)}" for key, value in parameters.items())


def _text(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else short(str(value))
