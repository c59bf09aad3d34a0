"""A finished run's records as CSV, in canonical order: results and timings apart, for only timings differ."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from bench.run.directory import Run
from bench.score.metrics import METRICS, own_metrics
from burrscan.files import written_whole


def write_tables(run: Run) -> None:
    """Write ``records.csv`` and ``timings.csv``."""
    parameters = list(run.records[0].parameters) if run.records else []
    names = [*METRICS, *own_metrics(run.suite.metrics)]
    heads = ["case", "variant", *parameters, "scene_hash", "failure", *names]
    rows = (
        [
            record.case,
            record.variant,
            *(record.parameters[name] for name in parameters),
            record.scene_hash,
            record.failure.error if record.failure else "",
            *(_cell(record.metrics.get(name, math.nan)) for name in names),
        ]
        for record in run.records
    )
    _write(run.directory.path / "records.csv", heads, rows)
    stages = list(dict.fromkeys(stage for record in run.records for stage in record.timings_s))
    times = (
        [record.case, record.variant, *(_cell(record.timings_s.get(stage, math.nan)) for stage in stages)]
        for record in run.records
    )
    _write(run.directory.path / "timings.csv", ["case", "variant", *stages], times)


def _cell(value: float) -> str:
    return f"{value:.9g}" if math.isfinite(value) else ""


def _write(path: Path, heads: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    with written_whole(path) as beside, beside.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(heads)
        writer.writerows(rows)
