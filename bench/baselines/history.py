"""A metric over accepted runs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.baselines.store import BASELINES, accepted
from bench.compare.margins import margin_of
from bench.compare.pairs import arm_of, pair
from bench.compare.result import Row
from bench.compare.rows import metric_row
from bench.compare.verdict import judged
from bench.run.directory import Run
from bench.run.records import count_failed
from bench.score.metrics import metric_named
from bench.summary.table import summarise, value_of
from burrscan.errors import InputError


@dataclass(frozen=True)
class Point:
    """A metric in one accepted run.

    Parameters
    ----------
    name, at, note
        The accepted run, when it was accepted, and why.
    version
        Version of the metric's definition; values of two versions are not comparable.
    commit
        The commit it was made with; empty where nobody knows.
    values
        Variant to the metric's summary over cases, as in the score table.
    halves
        Variant to the ends of the middle half of its cases.
    moved
        Variant to which way the metric went since the run before, and by how much, where the paired test of
        ``burrscan compare`` sees it at 95 %; so the commit moved it, or one since the run before did.
    failed
        Records without a result.

    """

    name: str
    at: str
    note: str
    version: int | None
    commit: str
    values: Mapping[str, float]
    halves: Mapping[str, tuple[float, float]]
    moved: Mapping[str, tuple[str, float]]
    failed: int


def history(metric: str, suite: str, *, baselines: Path = BASELINES) -> list[Point]:
    """A metric over a suite's accepted runs, oldest first.

    Raises
    ------
    burrscan.errors.InputError
        When there is no such metric, or no accepted run of the suite.

    """
    metric_named(metric)
    runs = accepted(suite, baselines=baselines)
    if not runs:
        raise InputError(f"{baselines / suite}: no accepted run; 'burrscan accept RUN' makes one")
    return [_point(run, metric, before) for run, before in zip(runs, [None, *runs], strict=False)]


def _point(run: Run, metric: str, before: Run | None) -> Point:
    definition = run.manifest["metrics"].get(metric)
    told = run.manifest.get("accepted", {})
    return Point(
        name=run.directory.path.name,
        at=str(told.get("at", "")),
        note=str(told.get("note", "")),
        version=definition["version"] if definition else None,
        commit=_commit(run),
        values={variant.name: _summary(run, metric, variant.name) for variant in run.suite.variant},
        halves={variant.name: _half(run, metric, variant.name) for variant in run.suite.variant},
        moved=_moved(before, run, metric) if before else {},
        failed=count_failed(run.records),
    )


def _summary(run: Run, metric: str, variant: str) -> float:
    if metric not in run.manifest["metrics"]:
        return math.nan
    return summarise(metric, [record for record in run.records if record.variant == variant])


def _half(run: Run, metric: str, variant: str) -> tuple[float, float]:
    values = np.array([value_of(r, metric) for r in run.records if r.variant == variant])
    known = values[np.isfinite(values)]
    if metric not in run.manifest["metrics"] or not known.size:
        return math.nan, math.nan
    low, high = np.percentile(known, (25.0, 75.0))
    return float(low), float(high)


def _moved(before: Run, run: Run, metric: str) -> dict[str, tuple[str, float]]:
    """Where both runs have the variant, the scenes and the metric's version in common."""
    versions = [(one.manifest["metrics"].get(metric) or {}).get("version") for one in (before, run)]
    known = {variant.name for variant in before.suite.variant}
    if versions[0] != versions[1] or versions[0] is None:
        return {}
    rows = {v.name: _row(before, run, metric, v.name) for v in run.suite.variant if v.name in known}
    return {name: (row.seen, row.difference) for name, row in rows.items() if row and row.seen}


def _row(before: Run, run: Run, metric: str, variant: str) -> Row | None:
    try:
        pairing = pair(*(arm_of(one, variant, variant) for one in (before, run)))
    except InputError:  # another suite under the same name: no case in common
        return None
    if not pairing.base:
        return None
    return judged([metric_row(pairing, metric, margin=margin_of(metric), gated=False, tested=False)])[0]


def _commit(run: Run) -> str:
    git = (run.manifest["sessions"][-1] if run.manifest["sessions"] else {}).get("git")
    return f"{git['commit'][:9]}{'+' if git['modified'] else ''}" if git else ""
