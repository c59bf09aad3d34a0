"""What a comparison says, as plain dataclasses: tables, files and reports are drawn from these."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from bench.score.metric import within

Verdict = Literal["worse", "better", "equivalent", "inconclusive", "not comparable"]
Seen = Literal["worse", "better", ""]
Typical = Literal["mean", "median"]
GateKind = Literal["margin", "lost", "floor", "ceiling"]
GateState = Literal["passed", "broken", "inconclusive", "not comparable"]


@dataclass(frozen=True)
class Row:
    """One metric in two arms.

    Parameters
    ----------
    metric, title, unit, better
        The metric; ``better`` is ``"higher"`` or ``"lower"``, ``unit`` is ``1`` for a share.
    typical
        ``mean`` or ``median``: what ``base``, ``new`` and ``difference`` are, see
        :func:`bench.summary.table.typical`.
    gated, tested
        Whether a gate judges it at all; whether one judges it by its margin.
    margin
        Differences up to this do not matter, in the metric's unit.
    base, new
        Means or medians over scenes of the cases that have a value in both arms.
    difference, low, high
        New minus base with its confidence interval, in the metric's unit: the mean difference, or the typical
        one (Hodges and Lehmann), which is not the difference of the medians.
    level
        Of the interval: that at which the verdict was reached, Holm's step included.
    mean_difference
        The mean difference, whatever ``typical`` says: one case can carry it.
    p, p_holm
        Two-sided p-value, and that corrected for all gated metrics of the comparison; equal where not tested.
    effect
        Mean difference over its standard deviation between scenes (Cohen's d of paired samples).
    drawn
        How many choices of signs were drawn for the test; 0 where all were counted.
    pairs, cases, scenes
        Pairs with a value in both arms, pairs in all, scenes.
    worse_cases, better_cases
        Pairs that went that way by more than the margin: facts about these cases.
    verdict
        See :func:`bench.compare.verdict.decide`.
    seen
        Which way the difference certainly goes, or nothing: zero is outside the interval. A metric may be
        equivalent and still be seen to be a little worse.
    every
        Which way all pairs go by more than the margin, in a suite too small for a test; or nothing.
    applies
        Whether any case could have the metric: a mesh that nobody scanned has no coverage.
    note
        What one must know to read the row.

    """

    metric: str
    title: str
    unit: str
    better: Literal["higher", "lower"]
    gated: bool
    margin: float
    typical: Typical = "mean"
    tested: bool = False
    base: float = math.nan
    new: float = math.nan
    difference: float = math.nan
    low: float = math.nan
    high: float = math.nan
    level: float = 0.95
    mean_difference: float = math.nan
    p: float = math.nan
    p_holm: float = math.nan
    effect: float = math.nan
    drawn: int = 0
    pairs: int = 0
    cases: int = 0
    scenes: int = 0
    worse_cases: int = 0
    better_cases: int = 0
    verdict: Verdict = "inconclusive"
    seen: Seen = ""
    every: Seen = ""
    applies: bool = True
    note: str = ""

    @property
    def by_every_case(self) -> bool:
        """Whether there are too few scenes for a verdict, but all cases went one way beyond the margin."""
        return self.verdict == "inconclusive" and bool(self.every)


@dataclass(frozen=True)
class BurrChange:
    """A true burr that one arm alone found: its case, its number there from 1, and its kind."""

    case: str
    number: int
    words: str

    def __str__(self) -> str:
        """As people call it."""
        return f"{self.case}: {self.name}"

    @property
    def name(self) -> str:
        """Its number in the case, and what it is."""
        return f"burr {self.number}{f' ({self.words})' if self.words else ''}"


def by_case(changes: Sequence[BurrChange]) -> dict[str, str]:
    """Case to the names of its burrs among ``changes``."""
    names: dict[str, list[str]] = {}
    for change in changes:
        names.setdefault(change.case, []).append(change.name)
    return {case: ", ".join(some) for case, some in names.items()}


@dataclass(frozen=True)
class FoundOrMissed:
    """True burrs of all pairs: found by both, lost and gained by name, missed by both."""

    both: int
    lost: tuple[BurrChange, ...]
    gained: tuple[BurrChange, ...]
    neither: int


@dataclass(frozen=True)
class GateOutcome:
    """What became of one gate.

    Parameters
    ----------
    metric, title
        The metric.
    kind
        ``margin``: what the difference means for other scenes. ``lost``: a fact about these. ``floor``,
        ``ceiling``: the new run's own value.
    state
        Whether it holds.
    said
        Why, in words.

    """

    metric: str
    title: str
    kind: GateKind
    state: GateState
    said: str


@dataclass(frozen=True)
class CaseChange:
    """How much one case changed: the worst and best change over gated metrics, in margins.

    Parameters
    ----------
    case
        The case.
    worst, worst_metric
        The largest change for the worse (infinite for a case that failed newly) and its metric.
    best, best_metric
        The largest change for the better, likewise.

    """

    case: str
    worst: float
    worst_metric: str
    best: float
    best_metric: str


@dataclass(frozen=True)
class FailedCase:
    """A case that failed in one arm only, or in both, and why."""

    case: str
    error: str


@dataclass(frozen=True)
class ArmComparison:
    """One variant against one other.

    Parameters
    ----------
    base, new
        Their labels.
    base_variant, new_variant
        Their variants' names.
    rows
        One per metric, gated ones first marked by ``gated``.
    gates
        What became of each gate.
    burrs
        Found or missed.
    newly_failed, newly_fixed, still_failing
        Cases without a result in the new arm only, in the base only, in both.
    changed, only_base, only_new
        Cases that could not be compared: the scene differs, or one arm lacks them.
    cases
        Every compared case, the worst change first.
    same_noise
        Whether each pair saw the same noise.
    run
        The new run's name where several are compared with one, see :func:`bench.compare.joined.joined`.

    """

    base: str
    new: str
    base_variant: str
    new_variant: str
    rows: tuple[Row, ...]
    gates: tuple[GateOutcome, ...]
    burrs: FoundOrMissed
    newly_failed: tuple[FailedCase, ...]
    newly_fixed: tuple[FailedCase, ...]
    still_failing: tuple[FailedCase, ...]
    changed: tuple[str, ...]
    only_base: tuple[str, ...]
    only_new: tuple[str, ...]
    cases: tuple[CaseChange, ...]
    same_noise: bool
    run: str = ""

    @property
    def comparable(self) -> bool:
        """Whether every case of the base and every gated metric could be compared."""
        refused = any(gate.state == "not comparable" for gate in self.gates)
        return not (self.changed or self.only_base or refused)


@dataclass(frozen=True)
class Comparison:
    """Everything a comparison says.

    Parameters
    ----------
    base, new
        Where the two sides come from.
    arms
        One comparison per variant, or the one of the two variants asked for.
    provenance
        What differs between the two runs: name to (base, new).

    """

    base: str
    new: str
    arms: tuple[ArmComparison, ...]
    provenance: Mapping[str, tuple[Any, Any]]

    @property
    def gates(self) -> Iterator[GateOutcome]:
        """The gates of all arms."""
        return (gate for arm in self.arms for gate in arm.gates)

    @property
    def worse(self) -> bool:
        """Whether a gate is broken."""
        return any(gate.state == "broken" for gate in self.gates)

    @property
    def exit_code(self) -> int:
        """0 nothing worse, 1 a gate broken, 2 something that is gated could not be compared."""
        if self.worse:
            return 1
        return 0 if all(arm.comparable for arm in self.arms) else 2

    def strict_exit_code(self) -> int:
        """As :attr:`exit_code`, and 1 where a gate is inconclusive."""
        undecided = any(gate.state == "inconclusive" for gate in self.gates)
        return self.exit_code or int(undecided)

    def sentence(self) -> str:
        """The verdict in one sentence: what broke, then what changed."""
        rows = [row for arm in self.arms for row in arm.rows if row.gated]
        broken = [
            f"{arm.new if arm.run else arm.new_variant}: {gate.said}" if len(self.arms) > 1 else gate.said
            for arm in self.arms
            for gate in arm.gates
            if gate.state == "broken"
        ]
        head = {0: "No gate is broken", 1: "A gate is broken", 2: "Not all of it can be compared"}
        if len(broken) > 1:
            head[1] = f"{len(broken)} gates are broken"
        why = f" ({'; '.join(broken)})" if broken else ""
        return f"{head[self.exit_code]}{why}: {self.new} against {self.base} is {'; '.join(_told(rows))}."


def _told(rows: Sequence[Row]) -> list[str]:
    """Worse and better metrics by name, the others by their number."""
    named, counted = [], []
    for verdict in ("worse", "better", "equivalent", "inconclusive", "not comparable"):
        some = [row for row in rows if row.verdict == verdict]
        if some and verdict in {"worse", "better"}:
            named.append(f"{verdict} in {', '.join(dict.fromkeys(within(row.title) for row in some))}")
        elif some:
            counted.append(f"{verdict} in {len(some)}")
    return [*named, *([f"{listed(counted)} of {len(rows)} gated metrics"] if counted else [])]


def listed(words: Sequence[str]) -> str:
    """Words with commas and an "and"."""
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)
