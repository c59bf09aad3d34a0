"""What a reader must see first: which gated metrics changed, by how much, and how sure that is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bench.compare.result import ArmComparison, Row
from bench.report.forest import by_every_case, shown, shown_unit
from bench.score.metric import within

_MOST = 8


@dataclass(frozen=True)
class Change:
    """A metric that is better or worse: in whom, by how much, and how sure that is."""

    arm: str
    title: str
    verdict: str
    difference: str
    unit: str
    sure: str


def changes(arms: Sequence[ArmComparison]) -> tuple[Change, ...]:
    """The gated metrics that are worse, then those that are better, the most margins first."""
    found = [
        (arm, row)
        for arm in arms
        for row in arm.rows
        if row.gated and (row.verdict in {"worse", "better"} or by_every_case(row))
    ]
    found.sort(key=lambda item: (_way(item[1]) != "worse", -_margins(item[1])))
    return tuple(_change(row, arm.new if len(arms) > 1 else "") for arm, row in found[:_MOST])


def _way(row: Row) -> str:
    """Which way it went: for other scenes, or else in every case here."""
    return row.every if by_every_case(row) else row.verdict


def _margins(row: Row) -> float:
    return abs(row.difference) / (row.margin or 1.0)


def _change(row: Row, arm: str) -> Change:
    return Change(
        arm,
        within(row.title),
        _way(row),
        shown(row.difference, row.unit, sign=True),
        "points" if row.unit == "1" else shown_unit(row.unit),
        _sure(row),
    )


def _sure(row: Row) -> str:
    if by_every_case(row):
        return f"in all {row.pairs} cases"
    low, high = (shown(value, row.unit, sign=True) for value in (row.low, row.high))
    return f"{100 * row.level:.3g} %: {low} to {high}" if row.low < row.high else ""


def winner(arms: Sequence[ArmComparison]) -> str:
    """Who wins, in one sentence: for other scenes, by gated metrics; or nobody."""
    counts = {id(arm): _ways(arm) for arm in arms}
    gained = max(arms, key=lambda arm: counts[id(arm)][0] - counts[id(arm)][1])
    better, worse = counts[id(gained)]
    if len(arms) > 1 and better > worse:
        return f"{gained.new} does best against {gained.base}: {_score(better, worse)}."
    if len(arms) > 1:
        return f"{gained.base} wins: no other is better in more metrics than it is worse in."
    if better and not worse:
        return f"{gained.new} wins against {gained.base}: {_score(better, worse)}."
    if worse and not better:
        return f"{gained.base} wins against {gained.new}, which is worse in {_metrics(worse)}."
    if better:
        return f"Neither wins outright: {gained.new} is {_score(better, worse)} than {gained.base}."
    return f"Neither wins: {gained.new} and {gained.base} differ in no gated metric that a test can tell."


def _ways(arm: ArmComparison) -> tuple[int, int]:
    """Gated metrics that are better, and worse."""
    ways = [_way(row) for row in arm.rows if row.gated]
    return ways.count("better"), ways.count("worse")


def _score(better: int, worse: int) -> str:
    return f"better in {_metrics(better)}, worse in {worse or 'none'}"


def _metrics(count: int) -> str:
    return f"{count} gated metric{'' if count == 1 else 's'}"


def ranking(arms: Sequence[ArmComparison]) -> str:
    """Several variants against the first in one sentence: how many gated metrics went which way."""
    counts = {arm.new: _counts(arm) for arm in arms}
    told = [f"{name} {count}" for name, count in counts.items() if count]
    none = [name for name, count in counts.items() if not count]
    verb = "is" if len(none) == 1 else "are"
    words = [f"{_listed(none)} {verb} neither better nor worse"] if none else []
    gated = sum(row.gated for row in arms[0].rows)
    return f"Against {arms[0].base}, in {gated} gated metrics: {'; '.join([*told, *words])}."


def _counts(arm: ArmComparison) -> str:
    verdicts = [row.verdict for row in arm.rows if row.gated]
    return " and ".join(
        f"{word} in {verdicts.count(word)}" for word in ("better", "worse") if word in verdicts
    )


def _listed(names: Sequence[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
