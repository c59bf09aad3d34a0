"""Gates: what decides the exit code, by inference, by fact, or by the new run's own value."""

from __future__ import annotations

import math
from collections.abc import Iterator

from bench.compare.margins import FAILURES
from bench.compare.pairs import Arm
from bench.compare.result import FoundOrMissed, GateKind, GateOutcome, GateState, Row
from bench.compare.text import number
from bench.run.records import count_failed
from bench.score.metric import within
from bench.suites.suite import Gate
from bench.summary.table import summarise

FOUND = "burr_found"
"""The metric that is a yes or no per burr."""


def outcomes(
    gate: Gate, row: Row, *, new: Arm, burrs: FoundOrMissed, same_noise: bool
) -> Iterator[GateOutcome]:
    """What became of each key of a gate.

    Parameters
    ----------
    gate
        The gate.
    row
        Its metric's row, with the verdict.
    new
        The new arm, for floors and ceilings.
    burrs
        Burrs lost and gained.
    same_noise
        Whether both arms saw the same noise; only then a case that got worse is a fact.

    """
    if gate.infers:
        yield _inferred(row)
    if gate.lost is not None:
        yield _lost(gate.lost, row, burrs, same_noise=same_noise)
    if gate.floor is not None or gate.ceiling is not None:
        yield from _absolute(gate, row, new)


def _inferred(row: Row) -> GateOutcome:
    title = within(row.title)
    if not row.applies:
        return _outcome(row, "margin", "passed", f"{title}: no case has it")
    if row.verdict == "worse":
        return _outcome(row, "margin", "broken", f"{title} is worse{_interval(row)}")
    if row.verdict == "not comparable":
        return _outcome(row, "margin", "not comparable", f"{title}: {row.note}")
    if row.verdict == "inconclusive" and row.every == "worse":
        why = f"{title} is worse beyond the margin in every one of {row.pairs} case(s)"
        return _outcome(row, "margin", "broken", why)
    if row.verdict == "inconclusive":
        return _outcome(row, "margin", "inconclusive", f"{title} is inconclusive{_interval(row)}")
    return _outcome(row, "margin", "passed", f"{title} is {row.verdict}")


def _interval(row: Row) -> str:
    if not math.isfinite(row.low) or not math.isfinite(row.high):
        return f": {row.scenes} scene(s) are too few for a test" if row.scenes else ""
    if row.low == row.high:
        return ""
    ends = " to ".join(number(value, row.unit, sign=True) for value in (row.low, row.high))
    return f": {100 * row.level:.3g} % interval {ends}, margin {number(row.margin, row.unit)}"


def _lost(allowed: int, row: Row, burrs: FoundOrMissed, *, same_noise: bool) -> GateOutcome:
    if row.verdict == "not comparable":
        return _outcome(row, "lost", "not comparable", f"{within(row.title)}: {row.note}")
    count = len(burrs.lost) if row.metric == FOUND else row.worse_cases
    what = f"{count} burr(s) lost" if row.metric == FOUND else f"{within(row.title)} worse in {count} case(s)"
    said = f"{what}, {allowed} allowed"
    if count <= allowed:
        return _outcome(row, "lost", "passed", said)
    if same_noise or row.verdict == "worse":
        return _outcome(row, "lost", "broken", said)
    return _outcome(row, "lost", "inconclusive", f"{said}; the arms saw different noise, it may be chance")


def _absolute(gate: Gate, row: Row, new: Arm) -> Iterator[GateOutcome]:
    value = _own_value(new, row.metric)
    shown, title = number(value, row.unit), within(row.title)
    if gate.floor is not None:
        state: GateState = "passed" if value >= gate.floor else "broken"
        yield _outcome(row, "floor", state, f"{title} {shown}, floor {number(gate.floor, row.unit)}")
    if gate.ceiling is not None:
        state = "passed" if value <= gate.ceiling else "broken"
        yield _outcome(row, "ceiling", state, f"{title} {shown}, ceiling {number(gate.ceiling, row.unit)}")


def _own_value(new: Arm, metric: str) -> float:
    """As in the score table; a metric that no case has holds no floor."""
    if metric == FAILURES:
        return float(count_failed(new.records))
    return summarise(metric, new.records)


def _outcome(row: Row, kind: GateKind, state: GateState, said: str) -> GateOutcome:
    return GateOutcome(row.metric, row.title, kind, state, said)
