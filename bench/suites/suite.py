"""The suite as a type, and reading one from a document."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Annotated, Any

from pydantic import Field

from bench.suites.design import RandomDesign, arranged_design
from bench.suites.paths import flatten
from bench.suites.pipelines import swept_pipelines
from bench.suites.sources import Source
from burrscan.documents import STRICT, build, problems_of, refuse
from burrscan.errors import InputError

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.+=-]*$", max_length=60)]
Values = Annotated[tuple[Any, ...], Field(min_length=1)]
CONDITION = "condition"
"""The parameter that names a case's condition."""

Seed = Annotated[int, Field(ge=0)]


@dataclass(frozen=True)
class Variant:
    """One pipeline under test.

    Parameters
    ----------
    name
        How tables and reports call it.
    stages
        Stage to the method that does it: a short name, ``"module:function"``, or a table of ``method`` and
        ``parameters``. Stages that are not named keep the pipeline's defaults.

    """

    __pydantic_config__ = STRICT

    name: Name
    stages: Mapping[str, str | Mapping[str, Any]] = field(default_factory=dict)


@dataclass(frozen=True)
class Gate:
    """A metric that decides whether a new run may pass; with several keys, each of them must hold.

    Parameters
    ----------
    metric
        Its name, or ``failures``.
    margin
        Inference: what the paired differences mean for other scenes. Differences up to this do not matter, in
        the metric's unit. Where no key is given it is the usual margin (:mod:`bench.compare.margins`).
    lost
        A fact: at most so many burrs may be lost (``burr_found``), or so many cases get worse by more than
        the margin (any other metric). It is one where both arms saw the same noise.
    floor, ceiling
        The new run's own value, as the score table shows it, may not be below, or above.

    """

    __pydantic_config__ = STRICT

    metric: str
    margin: Annotated[float, Field(ge=0.0)] | None = None
    lost: Annotated[int, Field(ge=0)] | None = None
    floor: float | None = None
    ceiling: float | None = None

    @property
    def infers(self) -> bool:
        """Whether a margin judges: one is given, or nothing else is."""
        return self.margin is not None or (self.lost, self.floor, self.ceiling) == (None, None, None)


@dataclass(frozen=True)
class Goal:
    """What a metric is wanted to reach; it is reported, and decides nothing.

    Parameters
    ----------
    metric
        Its name; it is summarised over the cases as in the score table.
    at_least, at_most
        The bounds, in the metric's unit.
    where
        Swept path to value: the cases it is about; all by default.
    variant
        Of whom; the suite's first variant by default.

    """

    __pydantic_config__ = STRICT

    metric: str
    at_least: float | None = None
    at_most: float | None = None
    where: Mapping[str, str | float | int | bool] = field(default_factory=dict)
    variant: str = ""


@dataclass(frozen=True)
class Suite:
    """What a run measures: scene points × seeds, each seen by every variant.

    Parameters
    ----------
    name, title, description
        For people; the name also names the run directory.
    scene
        The scene every case starts from, as plain tables. In a file it may name a ``base`` (a shipped scene
        or a file) and hold only what differs from it; :func:`bench.suites.load_suite` lays the two together.
    variant
        The pipelines under test.
    source
        What ``scene`` describes: a scene to be rendered and scanned, or a synthetic mesh
        (:class:`bench.synthetic.spec.MeshSpec`), which is only inspected.
    sweep
        Dotted path in the scene to the values it takes; the points are the full grid, the last path fastest.
        In a file also ``pipeline.STAGE.PARAMETER``: each of its values makes one more variant of every
        variant (:mod:`bench.suites.pipelines`).
    condition
        Name to overrides, dotted path in the scene to value: circumstances that are compared one by one, such
        as faults of the instrument. Crossed with everything else.
    random
        Points drawn over the bounds of some paths; every point of the grid is crossed with every one of them.
        In a file the paths stand in the table itself, beside ``points``.
    seeds
        Each seed is one more case per point: other noise, other draws of what jitters.
    jitter
        Dotted path in the scene to the bounds of a uniform draw from the case's own random stream.
    metrics
        Names for the score table; empty for the usual ones. Every metric is recorded in any case.
    gate
        What ``burrscan compare`` judges by; empty for the usual metrics and margins.
    groups
        Swept paths by whose values the score table is divided; the first one by default.
    budget
        Whether to find out which stage the errors come from (:mod:`bench.budget`), or of which variants.
    detectability
        Whether each scene is traced once more without its burrs, and once with them on the other side of the
        surface, which tells how well the frames shown could tell each of them (:mod:`scenes.detectability`).
    goal
        What the numbers are wanted to be.

    """

    __pydantic_config__ = STRICT

    name: Name
    scene: Mapping[str, Any]
    variant: Annotated[tuple[Variant, ...], Field(min_length=1)]
    title: str = ""
    description: str = ""
    source: Source = "scene"
    sweep: Mapping[str, Values] = field(default_factory=dict)
    condition: Mapping[Name, Mapping[str, Any]] = field(default_factory=dict)
    random: RandomDesign | None = None
    seeds: Annotated[tuple[Seed, ...], Field(min_length=1)] = (0,)
    jitter: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    metrics: tuple[str, ...] = ()
    gate: tuple[Gate, ...] = ()
    groups: tuple[str, ...] = ()
    budget: bool | tuple[str, ...] = False
    detectability: bool = False
    goal: tuple[Goal, ...] = ()

    @property
    def paths(self) -> tuple[str, ...]:
        """What distinguishes cases: their condition, then swept paths, then drawn ones."""
        condition = (CONDITION,) if self.condition else ()
        return (*condition, *self.sweep, *(self.random.draw if self.random else ()))

    @property
    def divided_by(self) -> tuple[str, ...]:
        """The paths that divide the score table."""
        return self.groups or self.paths[:1]

    @property
    def budgeted(self) -> tuple[str, ...]:
        """The variants that get an error budget."""
        if isinstance(self.budget, bool):
            return tuple(v.name for v in self.variant) if self.budget else ()
        return self.budget

    def document(self) -> dict[str, Any]:
        """The suite as plain tables, from which :func:`suite_from` makes an equal one."""
        tables = asdict(self)
        tables["gate"] = [{k: v for k, v in gate.items() if v is not None} for gate in tables["gate"]]
        tables["variant"] = [{"name": v.name, **v.stages} for v in self.variant]
        for key in ("random", "condition"):  # a suite without them is written as it always was
            if not tables.pop(key):
                continue
            tables[key] = self.random.document() if self.random and key == "random" else dict(self.condition)
        return tables


def suite_from(document: Mapping[str, Any], *, source: str) -> Suite:
    """Make a suite of plain tables, as TOML or JSON give them.

    Raises
    ------
    InputError
        With every error of form: unknown keys, wrong types, names that occur twice, empty jitter ranges.

    """
    suite = build(Suite, _arranged(document), source=source)
    refuse(_problems_of_form(suite), source)
    return suite


def suite_as_far(document: Mapping[str, Any], *, source: str) -> tuple[Suite, list[str], frozenset[str]]:
    """A suite of what can be read of a document, everything of form that is wrong, and the tables left out.

    What names mean can then be checked in the rest: a file's errors are listed at once, of whatever kind.
    """
    arranged = _arranged(document)
    try:
        suite = build(Suite, arranged, source=source)
    except InputError as error:
        problems = problems_of(error)
        readable, without = _readable(arranged, problems)
        return build(Suite, readable, source=source), problems, without
    return suite, _problems_of_form(suite), frozenset()


def _readable(arranged: Mapping[str, Any], problems: list[str]) -> tuple[dict[str, Any], frozenset[str]]:
    """A document without what its problems name (of a list, without that item), and the tables concerned."""
    paths = [problem.partition(":")[0].split(".") for problem in problems]
    without = frozenset(path[0] for path in paths)
    items = {(path[0], int(path[1])) for path in paths if len(path) > 1 and path[1].isdigit()}
    listed = {key for key, _ in items if isinstance(arranged.get(key), list | tuple)}
    whole = {path[0] for path in paths if path[0] not in listed or len(path) == 1}
    kept = {
        key: [one for i, one in enumerate(value) if (key, i) not in items] if key in listed else value
        for key, value in arranged.items()
        if key not in whole
    }
    needed = {"name": "unreadable", "scene": {}, "variant": [{"name": "unreadable"}]}
    return {**kept, **{key: kept.get(key) or usual for key, usual in needed.items()}}, without


_RESERVED = "truth"
"""No variant's name: what a run keeps of a case's truth bears it."""


def _problems_of_form(suite: Suite) -> list[str]:
    problems = [
        f"variant '{variant.name}': this name is the truth's; choose another"
        for variant in suite.variant
        if variant.name.lower() == _RESERVED
    ]
    problems += [*_twice("variant", [v.name for v in suite.variant]), *_twice("seed", list(suite.seeds))]
    problems += _twice("gate", [gate.metric for gate in suite.gate])
    problems += [
        f"jitter.{path}: the lower bound {low:g} is above the upper one {high:g}"
        for path, (low, high) in suite.jitter.items()
        if low > high
    ]
    problems += list(suite.random.problems()) if suite.random else []
    return problems + _both(suite)


def _both(suite: Suite) -> list[str]:
    """Paths that more than one table sets."""
    drawn = set(suite.random.draw if suite.random else ())
    conditions = {path for paths in suite.condition.values() for path in paths}
    sets = {"swept": set(suite.sweep), "drawn": drawn, "jittered": set(suite.jitter)}
    sets["set by a condition"] = conditions
    pairs = itertools.combinations(sets, 2)
    return [f"{path}: both {a} and {b}" for a, b in pairs for path in sorted(sets[a] & sets[b])]


def _arranged(document: Mapping[str, Any]) -> dict[str, Any]:
    """The document in the dataclass's own shape: dotted paths flat, a variant's stages in one table."""
    arranged = dict(document)
    for key in ("sweep", "jitter"):
        if isinstance(arranged.get(key), Mapping):
            arranged[key] = dict(flatten(arranged[key]))
    if isinstance(arranged.get("variant"), list | tuple):
        arranged["variant"] = [_arranged_variant(v) for v in arranged["variant"]]
    if isinstance(arranged.get(CONDITION), Mapping):
        arranged[CONDITION] = {
            name: dict(flatten(table)) if isinstance(table, Mapping) else table
            for name, table in arranged[CONDITION].items()
        }
    if "random" in arranged:
        arranged["random"] = arranged_design(arranged["random"])
    return swept_pipelines(arranged)


def _arranged_variant(table: Any) -> Any:
    if not isinstance(table, Mapping):
        return table
    stages = {key: value for key, value in table.items() if key != "name"}
    return {**{k: v for k, v in table.items() if k == "name"}, "stages": stages}


def _twice(what: str, items: list[Any]) -> list[str]:
    return [f"{what} '{item}' is given twice" for item in dict.fromkeys(items) if items.count(item) > 1]
