"""Runs in memory and on the disk, with numbers that tests choose."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from bench.run.directory import Run, RunDirectory, describe_run, load_run, write_manifest
from bench.run.provenance import session
from bench.run.records import Failure, Record, append
from bench.score.metrics import METRICS, failed_metrics
from bench.suites.case import Case
from bench.suites.suite import suite_from

FINISHES = ("polished", "turned", "ground", "blasted", "matte", "brushed", "cast", "honed")
USUAL = {
    "coverage": 0.9,
    "wrong_rate": 0.004,
    "depth_rms_mm": 0.05,
    "axis_deg": 0.01,
    "axis_offset_mm": 0.01,
    "generatrix_rms_mm": 0.03,
    "burr_found": 1.0,
    "burr_coverage": 0.95,
    "burr_angle_deg": 0.1,
    "burr_height_mm": 0.1,
    "false_calls": 1.0,
    "frames": 40.0,
}

Change = Callable[[int, dict[str, float]], Mapping[str, float]]


def written_run(folder: Path, *, change: Change = lambda _, metrics: metrics, **keys: Any) -> Run:
    """A run of eight finishes with two seeds, 16 scenes; ``change`` gets a case's number and metrics."""
    document = {
        "name": "tiny",
        "scene": {},
        "sweep": {"finish": list(FINISHES)},
        "seeds": [0, 1],
        "variant": [{"name": "mine"}],
        **keys,
    }
    suite = suite_from(document, source="test")
    cases = [
        Case(f"finish={f},seed={s}", {"finish": f, "seed": s}, s, {}, f"hash-{f}-{s}", f"identity-{f}-{s}")
        for f in FINISHES
        for s in (0, 1)
    ]
    metrics = {
        name: {"version": m.version, "unit": m.unit, "better": m.better} for name, m in METRICS.items()
    }
    manifest = describe_run(suite, cases, seed=0, metrics=metrics)
    write_manifest(
        RunDirectory(folder), {**manifest, "sessions": [session(workers=1, threads=1, renderer="none")]}
    )
    for variant in suite.variant:
        append(
            folder / "records.jsonl",
            [record_of(case, variant.name, change, number) for number, case in enumerate(cases)],
        )
    return load_run(folder)


def record_of(case: Case, variant: str, change: Change, number: int) -> Record:
    """A record with the usual numbers, a little different from case to case."""
    metrics = {name: value * (1.0 + 0.01 * (number % 5)) for name, value in USUAL.items()}
    metrics |= {"burr_found": 1.0, "coverage": 0.9 + 0.01 * (number % 5)}
    metrics = dict(change(number, metrics))
    burr = {"found": metrics["burr_found"] > 0.5, "height_mm": 1.0, "height_error_mm": 0.0}
    return Record(case.id, variant, case.parameters, case.scene_hash, case.identity, metrics, (burr,))


def with_failure(run: Run, number: int) -> Run:
    """The run with one case that raised."""
    record = replace(
        run.records[number],
        metrics=failed_metrics(),
        burrs=(),
        failure=Failure("pipeline", "ValueError: no light", "trace"),
    )
    return replace(run, records=(*run.records[:number], record, *run.records[number + 1 :]))


def with_plain_seeds(run: Run) -> Run:
    """The run with seeds that draw noise alone: eight scenes."""
    records = tuple(replace(r, scene_hash=f"hash-{r.parameters['finish']}") for r in run.records)
    return replace(run, records=records)
