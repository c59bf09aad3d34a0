"""What a run says in a sentence and in tables: summaries over cases, paired counts, burrs found."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.report.sides import Panel
from bench.run import Record, Run
from bench.score import HEADLINE, metric_named
from bench.score.metric import shown_unit
from bench.summary.table import summarise, typical, value_of

_FEWEST = 6
"""Cases of each side: of fewer no test of signs is significant at 5 % (2 / 2⁵ = 6 %)."""
_COMPARED_SHARE = 1e-9  # two shares nearer than this are the same


@dataclass(frozen=True)
class Cell:
    """A number of a table as text, whether it is the best of its row, and the number for a bar.

    ``verdict``: ``better`` or ``worse`` than the first side, where a comparison says so.
    """

    text: str
    best: bool = False
    value: float = math.nan
    verdict: str = ""


@dataclass(frozen=True)
class Row:
    """A row of a table: what it is about, and one cell per side."""

    title: str
    unit: str
    cells: tuple[Cell, ...]
    note: str = ""
    typical: str = ""
    """Mean or median, where the numbers are either."""


def of_variant(records: Iterable[Record], variant: str) -> list[Record]:
    """One variant's records."""
    return [record for record in records if record.variant == variant]


def score_rows(parts: Sequence[Sequence[Record]], names: Sequence[str]) -> tuple[Row, ...]:
    """The score table: a row per metric, summarised over each part's cases as on the terminal.

    Parameters
    ----------
    parts
        The records of each side.
    names
        Metrics; one that nobody has is left out.

    """
    return known_rows(score_row(parts, name) for name in names)


def score_row(parts: Sequence[Sequence[Record]], name: str) -> Row:
    """One metric of each part."""
    metric = metric_named(name)
    values = [summarise(name, part) for part in parts]
    texts = [number(value, metric.unit) for value in values]
    best = max if metric.better == "higher" else min
    if not _enough([_known(part, name) for part in parts]):
        values = [math.nan] * len(values)
    cells = _cells(values, texts, best)
    return Row(metric.title, shown_unit(metric.unit), cells, metric.description, typical(name))


def matrix(panel: Panel, names: Sequence[str]) -> tuple[Row, ...]:
    """The score of many sides, with the verdicts against the first one. O(sides × metrics × cases)."""
    verdicts = {(arm.new, row.metric): row.verdict for arm in panel.arms for row in arm.rows}
    parts = [list(side.records.values()) for side in panel.sides]
    rows = []
    for name in names:
        row = score_row(parts, name)
        told = [verdicts.get((side.label, name), "") for side in panel.sides]
        cells = [
            replace(cell, verdict=verdict) if verdict in {"better", "worse"} else cell
            for cell, verdict in zip(row.cells, told, strict=True)
        ]
        rows.append(replace(row, cells=tuple(cells)))
    return known_rows(rows)


def known_rows(rows: Iterable[Row]) -> tuple[Row, ...]:
    """Without those that nobody has a value in."""
    return tuple(row for row in rows if any(cell.text != "–" for cell in row.cells))


def _known(records: Sequence[Record], name: str) -> int:
    """How many cases have a value; a failed one counts as the worst."""
    return sum(not math.isnan(value_of(record, name)) for record in records)


def _enough(counts: Sequence[int]) -> bool:
    """Whether one side may be called the best: each has enough cases, and not far fewer than another.

    Fewer than six could not be told apart by any test of signs at 5 %.
    """
    return min(counts, default=0) >= max(_FEWEST, max(counts, default=0) / 2)


def metric_names(run: Run) -> tuple[str, ...]:
    """The metrics that the suite wants shown, or the usual ones."""
    return run.suite.metrics or HEADLINE


def time_rows(parts: Sequence[Sequence[Record]]) -> tuple[Row, ...]:
    """Median wall time of each stage over each part's cases, seconds; sums of rendering and of the rest."""
    stages = list(dict.fromkeys(stage for part in parts for record in part for stage in record.timings_s))
    times = {stage: [_median_time(part, stage) for part in parts] for stage in stages}
    rendered = {stage: values for stage, values in times.items() if stage in RENDERED}
    inspected = {stage: values for stage, values in times.items() if stage not in RENDERED}
    rows = [
        row
        for some, word in ((rendered, "rendering"), (inspected, "algorithm"))
        if some
        for row in (*_stage_rows(some), _time_row(f"{word}, together", _sums(some, len(parts))))
    ]
    return (*rows, _time_row("all stages", _sums(times, len(parts)))) if rows else ()


RENDERED = ("wheel", "transport", "truth")
"""Stages that make the pictures; the others are the algorithm under test and what is checked of it."""


def _stage_rows(times: Mapping[str, Sequence[float]]) -> list[Row]:
    return [_time_row(stage.removesuffix("_s").replace("_", " "), values) for stage, values in times.items()]


def _sums(times: Mapping[str, Sequence[float]], sides: int) -> list[float]:
    return [float(np.nansum([values[k] for values in times.values()])) for k in range(sides)]


def _median_time(records: Sequence[Record], stage: str) -> float:
    times = [record.timings_s[stage] for record in records if stage in record.timings_s]
    return float(np.median(times)) if times else math.nan


def _time_row(title: str, seconds: Sequence[float]) -> Row:
    return Row(title, "s", tuple(Cell("–" if math.isnan(s) else f"{s:.2f}", value=s) for s in seconds))


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


def verdict(records: Sequence[Record], variants: Sequence[str]) -> str:
    """The run in one plain sentence: the second variant beside the first, on the cases that both have."""
    first, *others = variants
    if not others:
        return _alone(of_variant(records, first), first)
    return _against(records, first, others[0])


def scanned(records: Iterable[Record]) -> bool:
    """Whether there was a scan: a mesh that nobody scanned has no coverage."""
    return any(
        not math.isnan(record.metrics.get("coverage", math.nan)) for record in records if not record.failure
    )


def _alone(records: Sequence[Record], name: str) -> str:
    if all(record.failure for record in records):
        return f"{name} has no result in any of {_count(len(records), 'case')}."
    found, there = burrs_found(records, true_burrs(records))
    covered = summarise("coverage", records)
    measured = (
        _axis_phrase(records)
        if not scanned(records)
        else f"measures {_percent(covered)} of the measurable pixels"
    )
    burrs = f" and finds {_of(found, there)}" if there else ""
    return f"{name} {measured}{burrs} in {_count(len(records), 'case')}."


def _axis_phrase(records: Sequence[Record]) -> str:
    """How near the axis is; an axis that is across says nothing of how near."""
    axis = summarise("axis_deg", records)
    if not axis < _ACROSS_DEG:
        return "does not find the axis in the median case"
    return f"has its axis within {number(axis, 'deg')} deg in the median case"


_ACROSS_DEG = 45.0
"""Beyond, an axis is nearer to being across than along."""


def _of(found: int, there: int) -> str:
    return f"{found} of {_count(there, 'burr')}" if found else f"none of {_count(there, 'burr')}"


def _against(records: Sequence[Record], first: str, other: str) -> str:
    a, b = ({r.case: r for r in of_variant(records, name)} for name in (first, other))
    both = [case for case in a if case in b]
    if not both:
        return f"{other} and {first} have no case in common yet."
    ours, theirs = [b[case] for case in both], [a[case] for case in both]
    there = true_burrs([*ours, *theirs])
    return f"{_accuracy_phrase(ours, theirs, other, first)}; {_burr_phrase(ours, theirs, first, there)}."


def _accuracy_phrase(ours: Sequence[Record], theirs: Sequence[Record], name: str, other: str) -> str:
    if not scanned(ours):
        return f"{name} {_axis_phrase(ours)}; {other} {_axis_phrase(theirs)}"
    failed = [who for who, part in ((name, ours), (other, theirs)) if all(r.failure for r in part)]
    if failed:
        return f"{' and '.join(failed)} {'has' if len(failed) == 1 else 'have'} no result in any case"
    points = (summarise("coverage", ours) - summarise("coverage", theirs)) * 100
    ahead = sum(
        value_of(x, "coverage") > value_of(y, "coverage") + _COMPARED_SHARE
        for x, y in zip(ours, theirs, strict=True)
    )
    direction = "more" if points >= 0 else "less"
    return (
        f"{name} measures {_percent(summarise('coverage', ours))} of the measurable pixels, "
        f"{abs(points):.1f} points {direction} than {other}"
        + (f", and is ahead in {ahead} of {_count(len(ours), 'case')}" if ahead else "")
    )


def _burr_phrase(
    ours: Sequence[Record], theirs: Sequence[Record], other: str, there: Mapping[str, int]
) -> str:
    (found, burrs), (their_found, _) = burrs_found(ours, there), burrs_found(theirs, there)
    calls, their_calls = summarise("false_calls", ours), summarise("false_calls", theirs)
    return (
        f"it finds {_of(found, burrs)} ({other}: {their_found or 'none'}), "
        f"with {number(calls, 'count')} false calls a case ({other}: {number(their_calls, 'count')})"
    )


def _cells(
    values: Sequence[float], texts: Sequence[str], best_of: Callable[[list[float]], float]
) -> tuple[Cell, ...]:
    known = [value for value in values if not math.isnan(value)]
    best = best_of(known) if len(set(texts)) > 1 and known else None
    return tuple(Cell(text, best=value == best) for value, text in zip(values, texts, strict=True))


def number(value: float, unit: str) -> str:
    """A metric's value as text, in :func:`bench.score.metric.shown_unit`."""
    if not math.isfinite(value):
        return "failed" if math.isinf(value) else "–"
    if unit == "1":
        return f"{100 * value:.1f}"
    return f"{value:.1f}".removesuffix(".0") if unit == "count" else f"{value:.3f}"


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"


def _count(count: int, thing: str) -> str:
    return f"{count} {thing}{'' if count == 1 else 's'}"
