"""From records to a score table: one row per group of cases and variant."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from bench.run.records import Record, count_failed
from bench.score.metrics import metric_named


@dataclass(frozen=True)
class Row:
    """One line of a score table.

    Parameters
    ----------
    group, variant
        Which records: those whose parameters have these values, or all (an empty group).
    cases, failed
        How many, and how many of them have no result.
    values
        Metric to its summary; NaN where no case has it, infinite where most cases failed.

    """

    group: tuple[str, ...]
    variant: str
    cases: int
    failed: int
    values: Mapping[str, float]


def score_table(records: Sequence[Record], metrics: Iterable[str], *, by: Sequence[str]) -> list[Row]:
    """Summarise records per values of the parameters ``by`` and variant, then over all.

    Errors (px, mm, deg) are summarised by their median, in which a case without a result ranks behind every
    error; shares and counts by their mean. O(records × metrics).
    """
    names = tuple(metrics)
    groups = list(dict.fromkeys(_group(record, by) for record in records)) if by else []
    variants = list(dict.fromkeys(record.variant for record in records))
    wanted = [(group, variant) for group in [*groups, ()] for variant in variants]
    return [
        _row(
            group,
            variant,
            [r for r in records if r.variant == variant and group in {_group(r, by), ()}],
            names,
        )
        for group, variant in wanted
    ]


def typical(name: str) -> Literal["mean", "median"]:
    """What sums up a metric over cases: errors (px, mm, deg) have medians, shares and counts have means.

    One case that goes wrong can make an error a thousand times as large, and no share or count.
    """
    return "median" if metric_named(name).unit in {"px", "mm", "deg"} else "mean"


def summarise(name: str, records: Iterable[Record]) -> float:
    """One metric over some records; see :func:`score_table`."""
    return middle(name, [value_of(record, name) for record in records])


def middle(name: str, values: Sequence[float]) -> float:
    """A metric's mean or median (:func:`typical`) over the values that are known; a mean's are finite."""
    found = np.array(values)
    if typical(name) == "median":
        known = found[~np.isnan(found)]
        return float(np.median(known)) if known.size else np.nan
    known = found[np.isfinite(found)]
    return float(known.mean()) if known.size else np.nan


def value_of(record: Record, name: str) -> float:
    """A record's value of a metric; without a result, what the metric counts that as."""
    return metric_named(name).on_failure if record.failure else record.metrics.get(name, np.nan)


def _group(record: Record, by: Sequence[str]) -> tuple[str, ...]:
    return tuple(str(record.parameters.get(path)) for path in by)


def _row(group: tuple[str, ...], variant: str, records: Sequence[Record], names: Sequence[str]) -> Row:
    failed = count_failed(records)
    return Row(group, variant, len(records), failed, {name: summarise(name, records) for name in names})
