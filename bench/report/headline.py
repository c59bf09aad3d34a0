"""What a reader must see first: which gated metrics changed, by how much, and how sure that is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bench.compare.result import ArmComparison, Row, listed
from bench.report.forest import shown
from bench.score.metric import shown_unit, within

_MOST = 8
"""Changes told in words; the table has them all."""


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
        if row.gated and (row.verdict in {"worse", "better"} or row.by_every_case)
    ]
    found.sort(key=lambda item: (_way(item[1]) != "worse", -_margins(item[1])))
    return tuple(_change(row, arm.new if len(arms) > 1 else "") for arm, row in found[:_MOST])


def _way(row: Row) -> str:
    """Which way it went: for other scenes, or else in every case here."""
    return row.every if row.by_every_case else row.verdict


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
    if row.by_every_case:
        return f"in all {row.pairs} cases"
    low, high = (shown(value, row.unit, sign=True) for value in (row.low, row.high))
    return f"{100 * row.level:.3g} %: {low} to {high}" if row.low < row.high else ""


def winner(arms: Sequence[ArmComparison], *, base: str = "", new: str = "") -> str:
    """Who wins, in one sentence, by gated metrics: one of two, the best of many variants, or nobody.

    Parameters
    ----------
    arms
        Variants against the first of them, or each variant of one run against itself in another.
    base, new
        The two runs, where there are two.

    """
    ways = [_ways(arm) for arm in arms]
    if len({arm.base for arm in arms}) == 1 and len(arms) > 1:
        return _best(arms, ways)
    better, worse = (sum(counts) for counts in zip(*ways, strict=True))
    new, base = (new, base) if len(arms) > 1 else (arms[0].new, arms[0].base)
    if better and not worse:
        return f"{new} wins against {base}: {_score(better, worse)}."
    if worse and not better:
        return f"{base} wins against {new}, which is worse in {_metrics(worse)}."
    if better:
        return f"Neither wins outright: {new} is {_score(better, worse)} than {base}."
    return f"Neither wins: {new} and {base} differ in no gated metric that a test can tell."


def _best(arms: Sequence[ArmComparison], ways: Sequence[tuple[int, int]]) -> str:
    """Of many variants against one."""
    first = max(range(len(arms)), key=lambda number: ways[number][0] - ways[number][1])
    better, worse = ways[first]
    if better > worse:
        return f"{arms[first].new} does best against {arms[first].base}: {_score(better, worse)}."
    return f"{arms[first].base} wins: no other is better in more metrics than it is worse in."


def _ways(arm: ArmComparison) -> tuple[int, int]:
    """Gated metrics that are better, and worse; one whose gate is broken by a fact is not better."""
    broken = {gate.metric for gate in arm.gates if gate.state == "broken"}
    gated = [row for row in arm.rows if row.gated]
    better = sum(_way(row) == "better" and row.metric not in broken for row in gated)
    return better, sum(_way(row) == "worse" or row.metric in broken for row in gated)


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
    words = [f"{listed(none)} {verb} neither better nor worse"] if none else []
    gated = sum(row.gated for row in arms[0].rows)
    return f"Against {arms[0].base}, in {gated} gated metrics: {'; '.join([*told, *words])}."


def _counts(arm: ArmComparison) -> str:
    verdicts = [row.verdict for row in arm.rows if row.gated]
    return " and ".join(
        f"{word} in {verdicts.count(word)}" for word in ("better", "worse") if word in verdicts
    )
