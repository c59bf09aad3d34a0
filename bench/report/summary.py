"""What a run says in a sentence and in tables: summaries over cases, paired counts, burrs found."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.run import Record, Run
from bench.score import HEADLINE, Metric, metric_named
from bench.score.summary import summarise

_COMPARED_SHARE = 1e-9  # two shares nearer than this are the same


@dataclass(frozen=True)
class Cell:
    """A number of a table as text, and whether it is the best of its row."""

    text: str
    best: bool = False


@dataclass(frozen=True)
class Row:
    """A row of a table: what it is about, and one cell per variant."""

    title: str
    unit: str
    cells: tuple[Cell, ...]
    note: str = ""


@dataclass(frozen=True)
class Group:
    """The cases that share one value of a swept parameter."""

    name: str
    rows: tuple[Row, ...]
    coverage: Mapping[str, float]


def of_variant(records: Iterable[Record], variant: str) -> list[Record]:
    """One variant's records."""
    return [record for record in records if record.variant == variant]


def score_rows(records: Sequence[Record], variants: Sequence[str], names: Sequence[str]) -> tuple[Row, ...]:
    """The score table: a row per metric, summarised over cases per variant as on the terminal."""
    return tuple(_metric_row(records, variants, metric_named(name)) for name in names)


def metric_names(run: Run) -> tuple[str, ...]:
    """The metrics that the suite wants shown, or the usual ones."""
    return run.suite.metrics or HEADLINE


def time_rows(records: Sequence[Record], variants: Sequence[str]) -> tuple[Row, ...]:
    """Median wall time of each stage, seconds."""
    stages = list(dict.fromkeys(stage for record in records for stage in record.timings_s))
    return tuple(
        Row(stage.removesuffix("_s").replace("_", " "), "s", _time_cells(records, variants, stage))
        for stage in stages
    )


def groups(records: Sequence[Record], variants: Sequence[str], parameter: str) -> tuple[Group, ...]:
    """The key figures apart for each value of a swept parameter, in the order in which the values occur."""
    values = list(dict.fromkeys(record.parameters[parameter] for record in records))
    return tuple(_group(records, variants, parameter, value) for value in values)


def swept(records: Sequence[Record]) -> list[str]:
    """Parameters that take several values, the seed left out."""
    values: dict[str, set[str]] = {}
    for record in records:
        for name, value in record.parameters.items():
            values.setdefault(name, set()).add(str(value))
    return [name for name, found in values.items() if len(found) > 1 and name != "seed"]


def burrs_found(records: Iterable[Record], there: Mapping[str, int]) -> tuple[int, int]:
    """Burrs found, and burrs there were.

    Parameters
    ----------
    records
        Of one variant.
    there
        Case to true burrs, as :func:`true_burrs` gives it: those of a failed case are there, and not found.

    """
    listed = list(records)
    found = sum(bool(burr["found"]) for record in listed for burr in record.burrs)
    return found, sum(there[record.case] for record in listed)


def true_burrs(records: Iterable[Record]) -> dict[str, int]:
    """Case to the number of its true burrs, known from any variant that did not fail."""
    there: dict[str, int] = {}
    for record in records:
        there[record.case] = max(there.get(record.case, 0), len(record.burrs))
    return there


def verdict(records: Sequence[Record], variants: Sequence[str]) -> tuple[str, ...]:
    """The run in plain sentences: each variant against the first one, on the cases that both have."""
    first, *others = variants
    if not others:
        return (_alone(of_variant(records, first), first),)
    return tuple(_against(records, first, other) for other in others)


def _alone(records: Sequence[Record], name: str) -> str:
    found, there = burrs_found(records, true_burrs(records))
    covered = summarise("coverage", records)
    return (
        f"{name} measures {_percent(covered)} of the measurable pixels and finds {found} of {there} burrs "
        f"in {_count(len(records), 'case')}."
    )


def _against(records: Sequence[Record], first: str, other: str) -> str:
    a, b = ({r.case: r for r in of_variant(records, name)} for name in (first, other))
    both = [case for case in a if case in b]
    if not both:
        return f"{other} and {first} have no case in common yet."
    ours, theirs = [b[case] for case in both], [a[case] for case in both]
    there = true_burrs([*ours, *theirs])
    return f"{_coverage_phrase(ours, theirs, other, first)}; {_burr_phrase(ours, theirs, first, there)}."


def _coverage_phrase(ours: Sequence[Record], theirs: Sequence[Record], name: str, other: str) -> str:
    points = (summarise("coverage", ours) - summarise("coverage", theirs)) * 100
    ahead = sum(
        x.metrics["coverage"] > y.metrics["coverage"] + _COMPARED_SHARE
        for x, y in zip(ours, theirs, strict=True)
    )
    direction = "more" if points >= 0 else "less"
    return (
        f"{name} measures {_percent(summarise('coverage', ours))} of the measurable pixels, "
        f"{abs(points):.1f} points {direction} than {other}, and is ahead in {ahead} of "
        f"{_count(len(ours), 'case')}"
    )


def _burr_phrase(
    ours: Sequence[Record], theirs: Sequence[Record], other: str, there: Mapping[str, int]
) -> str:
    (found, burrs), (their_found, _) = burrs_found(ours, there), burrs_found(theirs, there)
    calls, their_calls = summarise("false_calls", ours), summarise("false_calls", theirs)
    return (
        f"it finds {found} of {burrs} burrs ({other}: {their_found}), "
        f"with {number(calls, 'count')} false calls a case ({other}: {number(their_calls, 'count')})"
    )


def _group(records: Sequence[Record], variants: Sequence[str], parameter: str, value: object) -> Group:
    here = [record for record in records if record.parameters[parameter] == value]
    names = ("coverage", "wrong_rate", "depth_rms_mm")
    rows = (*score_rows(here, variants, names), _found_row(here, variants))
    coverage = {name: summarise("coverage", of_variant(here, name)) for name in variants}
    return Group(str(value), rows, coverage)


def _found_row(records: Sequence[Record], variants: Sequence[str]) -> Row:
    there = true_burrs(records)
    counts = [burrs_found(of_variant(records, name), there) for name in variants]
    values = [found / burrs if burrs else math.nan for found, burrs in counts]
    texts = [f"{found} of {burrs}" for found, burrs in counts]
    return Row("Burrs found", "count", _cells(values, texts, max))


def _metric_row(records: Sequence[Record], variants: Sequence[str], metric: Metric) -> Row:
    values = [summarise(metric.name, of_variant(records, name)) for name in variants]
    texts = [number(value, metric.unit) for value in values]
    best = max if metric.better == "higher" else min
    return Row(metric.title, shown_unit(metric.unit), _cells(values, texts, best), metric.description)


def _time_cells(records: Sequence[Record], variants: Sequence[str], stage: str) -> tuple[Cell, ...]:
    cells = []
    for name in variants:
        times = [r.timings_s[stage] for r in of_variant(records, name) if stage in r.timings_s]
        cells.append(Cell(f"{np.median(times):.2f}" if times else "–"))
    return tuple(cells)


def _cells(
    values: Sequence[float], texts: Sequence[str], best_of: Callable[[list[float]], float]
) -> tuple[Cell, ...]:
    known = [value for value in values if not math.isnan(value)]
    best = best_of(known) if len(set(texts)) > 1 and known else None
    return tuple(Cell(text, best=value == best) for value, text in zip(values, texts, strict=True))


def shown_unit(unit: str) -> str:
    """The unit that a table's heading states: shares are shown in per cent."""
    return "%" if unit == "1" else unit


def number(value: float, unit: str) -> str:
    """A metric's value as text, in :func:`shown_unit`."""
    if not math.isfinite(value):
        return "failed" if math.isinf(value) else "–"
    if unit == "1":
        return f"{100 * value:.1f}"
    return f"{value:.1f}".removesuffix(".0") if unit == "count" else f"{value:.3f}"


def failures(records: Iterable[Record]) -> list[dict[str, Any]]:
    """Every result that is missing, and why."""
    return [
        {"case": record.case, "variant": record.variant, "failure": record.failure}
        for record in records
        if record.failure
    ]


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"


def _count(count: int, thing: str) -> str:
    return f"{count} {thing}{'' if count == 1 else 's'}"
