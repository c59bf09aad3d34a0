"""A metric over accepted runs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from bench.baselines.store import BASELINES, accepted
from bench.run.directory import Run
from bench.score.metrics import metric_named
from bench.score.summary import summarise
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
    values
        Variant to the metric's summary over cases, as in the score table.
    failed
        Records without a result.

    """

    name: str
    at: str
    note: str
    version: int | None
    values: Mapping[str, float]
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
    return [_point(run, metric) for run in runs]


def _point(run: Run, metric: str) -> Point:
    definition = run.manifest["metrics"].get(metric)
    told = run.manifest.get("accepted", {})
    return Point(
        name=run.directory.path.name,
        at=str(told.get("at", "")),
        note=str(told.get("note", "")),
        version=definition["version"] if definition else None,
        values={variant.name: _summary(run, metric, variant.name) for variant in run.suite.variant},
        failed=sum(record.failure is not None for record in run.records),
    )


def _summary(run: Run, metric: str, variant: str) -> float:
    if metric not in run.manifest["metrics"]:
        return math.nan
    return summarise(metric, [record for record in run.records if record.variant == variant])
