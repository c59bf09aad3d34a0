"""Made-up runs that vary like real ones: no rendering, known differences.

A metric is drawn as ``mean + scene + seed + look`` on a scale where that is fair: logit for shares, log for
errors, log(1 + x) for counts. The spreads are estimated from ``repeats.csv`` (see
:mod:`bench.experiments.repeats`), where each case was looked at twice. Two arms share scene and seed and have
a look each.
"""

from __future__ import annotations

import csv
import itertools
import math
from collections.abc import Callable, Iterator, Mapping
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
from burrscan.arrays import Floats

NAMES = tuple(name for name in GATED if name != FAILURES)
FOUND = "burr_found"
_OF_FOUND = ("burr_angle_deg", "burr_height_mm")
_EDGE = 1e-5  # of a share, whose logit would be infinite


@dataclass(frozen=True)
class Spread:
    """Mean and standard deviations of a metric on its own scale: scenes, their seeds, looks of a seed."""

    mean: float
    scene: float
    seed: float
    look: float

    def draw(self, random: np.random.Generator, scenes: int, seeds: int) -> Floats:
        """Values (2 arms, scenes, seeds) on the metric's scale."""
        shared = self.scene * random.standard_normal((1, scenes, 1))
        shared = shared + self.seed * random.standard_normal((1, scenes, seeds))
        looks: Floats = self.mean + shared + self.look * random.standard_normal((2, scenes, seeds))
        return looks


@lru_cache(maxsize=4)
def spreads(variant: str = "adaptive") -> Mapping[str, Spread]:
    """Spreads of the gated metrics, from the real records of a variant."""
    with REPEATS.open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["variant"] == variant]
    return {name: _spread(name, rows) for name in NAMES}


def _spread(name: str, rows: list[dict[str, str]]) -> Spread:
    """Nested analysis of variance by moments: looks within seeds within scenes."""
    cases: dict[tuple[str, str], list[float]] = {}
    for row in rows:
        if row[name]:
            cases.setdefault((row["scene"], row["seed"]), []).append(scaled(name, float(row[name])))
    looks = float(np.mean([np.var(values, ddof=1) for values in cases.values() if len(values) > 1]))
    scenes: dict[str, list[float]] = {}
    for (scene, _), values in cases.items():
        scenes.setdefault(scene, []).append(float(np.mean(values)))
    within = float(np.mean([np.var(values, ddof=1) for values in scenes.values() if len(values) > 1]))
    means = np.array([np.mean(values) for values in scenes.values()])
    between = max(float(means.var(ddof=1)) - within / 2.0, 0.0)
    seeds = max(within - looks / 2.0, 0.0)
    return Spread(float(means.mean()), math.sqrt(between), math.sqrt(seeds), math.sqrt(looks))


def scaled(name: str, value: float) -> float:
    """A value on the scale where spreads are estimated."""
    unit = METRICS[name].unit
    if unit == "1":
        share = min(max(value, _EDGE), 1.0 - _EDGE)
        return math.log(share / (1.0 - share))
    return math.log1p(value) if unit == "count" else math.log(max(value, 1e-9))


def unscaled(name: str, values: Floats) -> Floats:
    """Back to the metric's unit; counts are whole."""
    unit = METRICS[name].unit
    if unit == "1":
        return np.asarray(1.0 / (1.0 + np.exp(-values)), np.float64)
    if unit == "count":
        return np.asarray(np.round(np.maximum(np.expm1(values), 0.0)), np.float64)
    return np.asarray(np.exp(values), np.float64)


def alike(random: np.random.Generator, *, scenes: int, seeds: int) -> tuple[Run, Run]:
    """Two runs of the same algorithm that differ by their looks alone."""
    drawn = {name: unscaled(name, spread.draw(random, scenes, seeds)) for name, spread in spreads().items()}
    drawn[FOUND] = _found(random, scenes, seeds)
    for name in _OF_FOUND:
        drawn[name] = np.where(drawn[FOUND] > 0.0, drawn[name], np.nan)
    return _run("base", drawn, 0), _run("new", drawn, 1)


def _found(random: np.random.Generator, scenes: int, seeds: int) -> Floats:
    """Found (1) or missed (0), (2, scenes, seeds): 9 of 10, and scenes are much more alike than seeds."""
    ease = Spread(1.28 * math.sqrt(2.5), 1.0, 0.7, 1.0).draw(random, scenes, seeds)
    return (ease > 0.0).astype(float)


def planted(run: Run, name: str, amount: float, random: np.random.Generator) -> Run:
    """The run with one metric made worse by ``amount`` in its unit, on average over cases."""
    sign = 1.0 if METRICS[name].better == "lower" else -1.0
    change: Callable[[float], float] = lambda value: value + sign * amount  # noqa: E731
    if name == FOUND:
        found = np.mean([record.metrics[FOUND] for record in run.records])
        change = lambda value: float(value > 0.0 and random.random() >= amount / found)  # noqa: E731
    return replace(run, records=tuple(_changed(record, name, change) for record in run.records))


def _changed(record: Record, name: str, change: Callable[[float], float]) -> Record:
    metrics = {**record.metrics, name: change(record.metrics[name])}
    return replace(record, metrics=metrics, burrs=({"found": metrics[FOUND] > 0.0},))


def _run(label: str, drawn: Mapping[str, Floats], arm: int) -> Run:
    shape = drawn[FOUND].shape[1:]
    records = tuple(_records(drawn, arm, *shape))
    definitions = {name: {"version": 1, "unit": m.unit, "better": m.better} for name, m in METRICS.items()}
    suite = Suite("made-up", {}, (Variant("algorithm"),))
    cases = [{"id": record.case} for record in records]
    manifest = {"metrics": definitions, "cases": cases, "sessions": [], "suite_hash": "0"}
    return Run(RunDirectory(Path(label)), suite, 0, manifest, records)


def _records(drawn: Mapping[str, Floats], arm: int, scenes: int, seeds: int) -> Iterator[Record]:
    for scene, seed in itertools.product(range(scenes), range(seeds)):
        metrics = {name: float(values[arm, scene, seed]) for name, values in drawn.items()}
        case = f"scene={scene},seed={seed}"
        yield Record(
            case=case,
            variant="algorithm",
            parameters={"scene": scene, "seed": seed},
            scene_hash=case,
            identity=case,
            metrics=metrics,
            burrs=({"found": metrics[FOUND] > 0.0},),
        )
