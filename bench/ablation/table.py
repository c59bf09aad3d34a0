"""What gets worse without each step, by how much and how sure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bench.ablation.measure import WHOLE, Seen
from bench.ablation.steps import Step
from bench.compare.holm import holm
from bench.score.metrics import metric_named
from bench.statistics.flips import FlipTest, mean_test, rank_test
from bench.summary.table import typical
from burrscan.arrays import Floats

METRICS = (
    "coverage", "wrong_rate", "depth_rms_mm", "axis_deg", "axis_held", "axis_offset_mm", "generatrix_rms_mm",
    "burr_found", "burr_located", "burr_angle_deg", "burr_height_mm", "burr_extent_mm", "false_calls",
)  # fmt: skip
"""Judged together: five in a hundred such tables may call one change that chance made."""
LEVEL = 0.05
"""Of all tests of a table."""


@dataclass(frozen=True)
class Change:
    """A metric without a step, less the same with it; ``probability`` allows for all tests of the table."""

    metric: str
    value: float
    worse: bool
    probability: float


@dataclass(frozen=True)
class Row:
    """What a step is worth: true burrs lost and won without it, and what else changes for sure."""

    step: Step
    cases: int
    lost: int
    won: int
    changes: tuple[Change, ...]

    @property
    def earns_its_place(self) -> bool:
        """Whether anything is worse without it, for sure."""
        return any(change.worse for change in self.changes)


def rows(seen: Sequence[Seen], steps: Sequence[Step]) -> list[Row]:
    """A row for each step; each case is a scene of its own, and its difference one number."""
    whole = {one.case: one for one in seen if one.step == WHOLE}
    arms = {step.name: [one for one in seen if one.step == step.name and one.case in whole] for step in steps}
    tests = {
        (step.name, metric): test
        for step in steps
        for metric in METRICS
        if (test := _test(metric, arms[step.name], whole)).speaks
    }
    probabilities = holm(np.array([test.p() for test in tests.values()]))
    sure = {
        key: (test, float(p))
        for (key, test), p in zip(tests.items(), probabilities, strict=True)
        if p <= LEVEL
    }
    return [
        Row(
            step,
            len(arms[step.name]),
            sum(was and not now for one in arms[step.name] for was, now in _pairs(one, whole)),
            sum(now and not was for one in arms[step.name] for was, now in _pairs(one, whole)),
            tuple(
                _change(metric, *sure[step.name, metric]) for metric in METRICS if (step.name, metric) in sure
            ),
        )
        for step in steps
    ]


def _pairs(one: Seen, whole: dict[str, Seen]) -> Iterator[tuple[bool, bool]]:
    return zip(whole[one.case].found, one.found, strict=True)


def _test(metric: str, arm: Sequence[Seen], whole: dict[str, Seen]) -> FlipTest:
    differences: Floats = np.array([one.metrics[metric] - whole[one.case].metrics[metric] for one in arm])
    known = differences[np.isfinite(differences)]
    return (rank_test if typical(metric) == "median" else mean_test)(known)


def _change(metric: str, test: FlipTest, probability: float) -> Change:
    higher = metric_named(metric).better == "higher"
    return Change(metric, test.value, (test.value < 0.0) == higher, probability)


def markdown(table: Sequence[Row]) -> str:
    """The table, steps in the order of the pipeline."""
    head = ["without", "stage", "burrs lost / won", "worse", "better"]
    lines = [head, ["---"] * len(head)]
    for row in table:
        sides = [[_words(one) for one in row.changes if one.worse is worse] for worse in (True, False)]
        lines.append(
            [
                row.step.name,
                row.step.stage,
                f"{row.lost} / {row.won}",
                *(", ".join(side) or "–" for side in sides),
            ]
        )
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def _words(change: Change) -> str:
    metric = metric_named(change.metric)
    if metric.unit == "1":
        size = f"{100.0 * change.value:+.2g} points"
    else:
        size = f"{change.value:+.2g}" + ("" if metric.unit == "count" else f" {metric.unit}")
    return f"{metric.title.lower()} {size} (p {change.probability:.1g})"
