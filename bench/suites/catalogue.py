"""Finding a suite by name or path, and checking it against everything it names."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any

from bench.score.metrics import METRICS, metric_named
from bench.suites.case import Case
from bench.suites.cases import expand
from bench.suites.paths import merge
from bench.suites.suite import Suite, suite_as_far
from bench.suites.variants import pipeline_of
from burrscan.documents import problems_of, read_toml, refuse
from burrscan.errors import InputError
from burrscan.variants import suggest
from scenes.scene import scene_document, wheel_beside, with_wheel_beside

_DISTINGUISH = frozenset({"sweep", "random", "condition"})
"""Tables that say which paths distinguish cases."""
_OF_CASES = _DISTINGUISH | {"scene", "source"}
"""Tables without which there are no cases to check."""


def suite_names() -> list[str]:
    """The suites that come with burrscan."""
    folder = resources.files("bench.suites")
    return sorted(Path(item.name).stem for item in folder.iterdir() if item.name.endswith(".toml"))


def load_suite(name_or_path: str | Path, *, code: bool = True) -> Suite:
    """Read a suite, lay its scene over its base, and check every case it makes.

    Parameters
    ----------
    name_or_path
        A shipped suite's name, or the path of a TOML file. Scene files are looked for beside it.
    code
        Whether to import what it names as ``"module:function"``, and to check how it is called.

    Raises
    ------
    InputError
        With every error at once.

    """
    path = _find(name_or_path)
    document = read_toml(path)
    problems: list[str] = []
    try:
        document = {**document, **_scenes(document, path)}
    except InputError as error:
        problems = [f"scene: {problem}" for problem in problems_of(error)]
    suite, of_form, without = suite_as_far(document, source=str(path))
    if problems:
        without |= {"scene"}
    problems += [*of_form, *_problems(suite, without, code=code)]
    refuse(list(dict.fromkeys(problems)), str(path))
    return suite


def _find(name_or_path: str | Path) -> Path:
    text = str(name_or_path)
    if text.endswith(".toml") or "/" in text:
        return Path(text)
    if text not in suite_names():
        raise InputError(
            f"unknown suite '{text}': {suggest(text, suite_names())} (or the path of a .toml file)"
        )
    return Path(str(resources.files("bench.suites").joinpath(f"{text}.toml")))


def _scenes(document: Mapping[str, Any], path: Path) -> dict[str, Any]:
    """The suite's scene and sweep; wheel files are looked for beside the suite's."""
    found = {"scene": _scene(document.get("scene"), path)}
    for table in ("sweep", "random"):
        values = document.get(table)
        if isinstance(values, Mapping) and isinstance(values.get("wheel"), list):
            found[table] = {
                **values,
                "wheel": [wheel_beside(wheel, path.parent) for wheel in values["wheel"]],
            }
    return found


def _scene(table: Any, path: Path) -> Any:
    """The scene's tables laid over the base they name."""
    if isinstance(table, Mapping):
        table = with_wheel_beside(table, path.parent)
    if not isinstance(table, Mapping) or "base" not in table:
        return table
    base = str(table["base"])
    beside = path.parent / base
    over = {key: value for key, value in table.items() if key != "base"}
    return merge(scene_document(str(beside) if beside.suffix == ".toml" and beside.exists() else base), over)


def _problems(suite: Suite, without: AbstractSet[str], *, code: bool) -> Iterator[str]:
    """Everything that is wrong with what the suite names, but for what follows from tables left out."""
    if not code:
        suite = _without_code(suite)
    yield from _metric_problems(suite)
    yield from _goal_problems(suite)
    if not without & _DISTINGUISH:
        yield from _path_goal_problems(suite)
    if "variant" not in without:
        yield from _unknown_variants("budget", suite, suite.budgeted)
        yield from _variant_goal_problems(suite)
    for variant in suite.variant:
        yield from _listed(f"variant '{variant.name}'", partial(pipeline_of, variant))
    if not without & _OF_CASES:
        yield from _listed("scene", lambda: _no_twins(expand(suite)))


def _without_code(suite: Suite) -> Suite:
    """The suite without what it names by ``"module:attribute"``; that cannot be checked unless imported."""

    def named(text: object) -> bool:
        return isinstance(text, str) and ":" in text

    def shipped(stages: Mapping[str, Any]) -> dict[str, Any]:
        methods = {key: s.get("method") if isinstance(s, Mapping) else s for key, s in stages.items()}
        return {key: stage for key, stage in stages.items() if not named(methods[key])}

    return replace(
        suite,
        variant=tuple(replace(variant, stages=shipped(variant.stages)) for variant in suite.variant),
        metrics=tuple(name for name in suite.metrics if not named(name)),
        gate=tuple(gate for gate in suite.gate if not named(gate.metric)),
        goal=tuple(goal for goal in suite.goal if not named(goal.metric)),
    )


def _no_twins(cases: Sequence[Case]) -> None:
    """Refuse cases that bear the same name."""
    twins = [name for name, count in Counter(case.id for case in cases).items() if count > 1]
    refuse([f"two cases are called '{name}'" for name in twins], "sweep")


def _metric_problems(suite: Suite) -> Iterator[str]:
    for name in suite.metrics:
        yield from _listed("metrics", partial(metric_named, name))
    for gate in suite.gate:
        if gate.metric not in {"failures", *METRICS, *suite.metrics}:
            yield f"gate: unknown metric '{gate.metric}': {suggest(gate.metric, ['failures', *METRICS])}"
            continue
        better = "lower" if gate.metric == "failures" else metric_named(gate.metric).better
        for key, suits in (("floor", "higher"), ("ceiling", "lower")):
            if getattr(gate, key) is not None and better != suits:
                yield f"gate {gate.metric}: {key} is for metrics where {suits} is better; here {better} is"


def _goal_problems(suite: Suite) -> Iterator[str]:
    for goal in suite.goal:
        yield from _listed("goal", partial(metric_named, goal.metric))
        if goal.at_least is None and goal.at_most is None:
            yield f"goal: '{goal.metric}' has neither at_least nor at_most"


def _variant_goal_problems(suite: Suite) -> Iterator[str]:
    for goal in suite.goal:
        if goal.variant:
            yield from _unknown_variants("goal", suite, [goal.variant])


def _path_goal_problems(suite: Suite) -> Iterator[str]:
    for goal in suite.goal:
        yield from (f"goal: {problem}" for problem in _path_problems(suite, goal.where))
    yield from (f"groups: {problem}" for problem in _path_problems(suite, suite.groups))


def _unknown_variants(what: str, suite: Suite, named: Iterable[str]) -> Iterator[str]:
    names = [variant.name for variant in suite.variant]
    yield from (f"{what}: unknown variant '{n}': {suggest(n, names)}" for n in named if n not in names)


def _path_problems(suite: Suite, paths: Iterable[str]) -> Iterator[str]:
    for path in paths:
        if path not in suite.paths:
            yield f"'{path}' is not swept: {suggest(path, list(suite.paths))}"


def _listed(where: str, attempt: Callable[[], object]) -> Iterator[str]:
    """What an attempt complains of, line by line."""
    try:
        attempt()
    except InputError as error:
        yield from (f"{where}: {problem}" for problem in problems_of(error))
