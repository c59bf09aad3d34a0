"""Learning from a run what the next one will cost."""

from __future__ import annotations

import json
import statistics
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path

from bench.run.costs import START_S, costs_file, known_costs, megapixels, pipeline_key
from bench.run.directory import Run
from bench.run.records import Record
from bench.suites.case import Case
from bench.suites.suite import Suite
from burrscan.files import write_text

_MADE = ("wheel", "transport", "truth", "mesh")
"""Stages that all variants of a case share."""

_LEAST_S, _LEAST_CASES = 60.0, 8  # a shorter run says more of its start than of its cases


def update_cost_model(
    folder: Path | None, run: Run, cases: Iterable[Case], *, wall_s: float, workers: int
) -> None:
    """Leave the figures of a sitting's cases in ``folder``; one too short to tell teaches nothing."""
    done = {case.id: megapixels(run.suite, case) for case in cases}
    records = [r for r in run.records if r.case in done and r.failure is None]
    if folder is None or wall_s < _LEAST_S or len(done) < _LEAST_CASES or not records:
        return
    known = known_costs(folder)
    seconds = {**known.seconds, **_measured(run.suite, records, done)}
    seconds[run.suite.source] = _made(records, done, known.making(run.suite.source))
    spent_s = sum(sum(r.timings_s.values()) for r in records)
    shared_s = sum(_shared_s(r) for r in records) * (1.0 - 1.0 / len(run.suite.variant))
    found = replace(
        known,
        seconds=seconds,
        overhead=max(1.0, (wall_s - START_S) * workers / max(spent_s - shared_s, 1e-9)),
        record_bytes=_bytes(run, done) / len(records),
        measured=datetime.now(UTC).date().isoformat(),
    )
    with suppress(OSError):  # a folder that cannot be written costs an estimate, not the run
        folder.mkdir(parents=True, exist_ok=True)
        write_text(costs_file(folder), json.dumps(asdict(found), indent=1) + "\n")


def _measured(suite: Suite, records: Sequence[Record], size: Mapping[str, float]) -> dict[str, float]:
    """Seconds per megapixel of each pipeline: medians, for the first case also compiles."""
    found = {}
    for variant in suite.variant:
        rates = [
            (sum(r.timings_s.values()) - _shared_s(r)) / size[r.case]
            for r in records
            if r.variant == variant.name
        ]
        if rates:
            found[pipeline_key(variant)] = statistics.median(rates)
    return found


def _made(records: Sequence[Record], size: Mapping[str, float], known: float) -> float:
    """Seconds per megapixel to make a case; light that was traced before and only read tells nothing."""
    rate = statistics.median(_shared_s(r) / size[r.case] for r in records)
    return rate if rate > 0.5 * known else known


def _shared_s(record: Record) -> float:
    return sum(record.timings_s.get(stage, 0.0) for stage in _MADE)


def _bytes(run: Run, cases: Iterable[str]) -> int:
    folders = (run.directory.case(case) for case in cases)
    return sum(file.stat().st_size for folder in folders for file in folder.glob("*") if file.is_file())
