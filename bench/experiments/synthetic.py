"""Made-up runs that vary like real ones: no rendering, known differences.

A scene is drawn from the real ones of ``repeats.csv`` (:mod:`bench.experiments.repeats`), with replacement,
and each arm gets one of its real looks with *all* of that look's metrics and burrs. So heavy tails, ties,
whole numbers and what goes together are those of real records; no distribution is assumed.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from bench.compare.margins import FAILURES, GATED
from bench.experiments.repeats import REPEATS
from bench.run.directory import Run, RunDirectory
from bench.run.records import Record
from bench.score.metrics import METRICS
from bench.suites.suite import Suite, Variant

NAMES = tuple(name for name in GATED if name != FAILURES)
FOUND, CALLS = "burr_found", "false_calls"


@dataclass(frozen=True)
class Look:
    """One real look at one real scene: its metrics, and which of its burrs were found."""

    metrics: Mapping[str, float]
    found: tuple[bool, ...]


@lru_cache(maxsize=1)
def real_looks() -> tuple[tuple[Look, ...], ...]:
    """Every real scene's looks."""
    scenes: dict[tuple[str, str], list[Look]] = {}
    with REPEATS.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            metrics = {name: float(row[name]) if row.get(name) else math.nan for name in METRICS}
            look = Look(metrics, tuple(mark == "1" for mark in row["found"]))
            scenes.setdefault((row["scene"], row["seed"]), []).append(look)
    return tuple(map(tuple, scenes.values()))


def alike(random: np.random.Generator, *, scenes: int, same_noise: bool = False) -> tuple[Run, Run]:
    """Two runs of the same algorithm on scenes drawn: with other noise in each arm, or with the same."""
    looks = real_looks()
    drawn = [looks[k] for k in random.integers(0, len(looks), scenes)]
    chosen = [random.permutation(len(some))[:2] for some in drawn]
    arms = [[some[k[arm]] for some, k in zip(drawn, chosen, strict=True)] for arm in (0, 1)]
    return _run("base", arms[0], ""), _run("new", arms[0 if same_noise else 1], "" if same_noise else "'")


def planted(run: Run, name: str, amount: float, random: np.random.Generator) -> Run:
    """The run with one metric made worse by ``amount`` in its unit, on average over cases.

    An error or a share changes by that much in every case. A burr found is lost by lot, and by lot a case has
    one more false call.
    """
    return replace(run, records=tuple(_worse(record, name, amount, random, run) for record in run.records))


def _worse(record: Record, name: str, amount: float, random: np.random.Generator, run: Run) -> Record:
    if name == FOUND:
        found = float(np.mean([r.metrics[FOUND] for r in run.records]))
        return blinded(record, min(amount / found, 1.0), random)
    if name == CALLS:
        change = float(random.random() < amount)
    else:
        change = amount if METRICS[name].better == "lower" else -amount
    return replace(record, metrics={**record.metrics, name: record.metrics[name] + change})


def blinded(record: Record, share: float, random: np.random.Generator) -> Record:
    """The record with each burr that was found lost with a chance of ``share``."""
    marks = tuple(bool(burr["found"]) and random.random() >= share for burr in record.burrs)
    metrics = {**record.metrics, FOUND: float(np.mean(marks))}
    return replace(record, metrics=metrics, burrs=tuple({"found": mark} for mark in marks))


def _run(label: str, looks: Sequence[Look], noise: str) -> Run:
    records = tuple(
        Record(
            case=f"scene={number}",
            variant="algorithm",
            parameters={"scene": number},
            scene_hash=str(number),
            identity=f"{number}{noise}",
            metrics=look.metrics,
            burrs=tuple({"found": mark} for mark in look.found),
        )
        for number, look in enumerate(looks)
    )
    definitions = {name: {"version": 1, "unit": m.unit, "better": m.better} for name, m in METRICS.items()}
    suite = Suite("made-up", {}, (Variant("algorithm"),))
    cases = [{"id": record.case} for record in records]
    manifest = {"metrics": definitions, "cases": cases, "sessions": [], "suite_hash": "0"}
    return Run(RunDirectory(Path(label)), suite, 0, manifest, records)
