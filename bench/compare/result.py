"""What a comparison says, as plain dataclasses: tables, files and reports are drawn from these."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from bench.score.metric import within

Verdict = Literal["worse", "better", "equivalent", "inconclusive", "not comparable"]
Seen = Literal["worse", "better", ""]


@dataclass(frozen=True)
class Row:
    """One metric in two arms.

    Parameters
    ----------
    metric, title, unit, better
        The metric; ``better`` is ``"higher"`` or ``"lower"``, ``unit`` is ``1`` for a share.
    gated
        Whether it decides the exit code.
    margin
        Differences up to this do not matter, in the metric's unit.
    base, new
        Means over scenes of the cases that have a value in both arms (burrs: shares of all burrs).
    difference, low, high
        New minus base, with its 95 % confidence interval, in the metric's unit.
    p, p_holm
        Two-sided p-value, and that corrected for all gated metrics of the comparison; equal where not gated.
    effect
        Difference over its standard deviation between scenes (Cohen's d of paired samples).
    pairs, cases, scenes
        Pairs with a value in both arms, pairs in all, scenes.
    verdict
        See :func:`bench.compare.verdict.decide`.
    seen
        Which way the difference certainly goes, or nothing: zero is outside the interval, and ``p_holm`` at
        most 0.05. A metric may be equivalent and still be seen to be a little worse.
    every
        Which way all pairs go by more than the margin, in a suite too small for a test; or nothing.
    note
        What one must know to read the row.

    """

    metric: str
    title: str
    unit: str
    better: Literal["higher", "lower"]
    gated: bool
    margin: float
    base: float
    new: float
    difference: float
    low: float
    high: float
    p: float
    p_holm: float
    effect: float
    pairs: int
    cases: int
    scenes: int
    verdict: Verdict
    seen: Seen = ""
    every: Seen = ""
    note: str = ""


@dataclass(frozen=True)
class FoundOrMissed:
    """True burrs of all pairs: found by both, lost, gained, missed by both; McNemar's exact p-value."""

    both: int
    lost: int
    gained: int
    neither: int
    p: float


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

    """

    base: str
    new: str
    base_variant: str
    new_variant: str
    rows: tuple[Row, ...]
    burrs: FoundOrMissed
    newly_failed: tuple[FailedCase, ...]
    newly_fixed: tuple[FailedCase, ...]
    still_failing: tuple[FailedCase, ...]
    changed: tuple[str, ...]
    only_base: tuple[str, ...]
    only_new: tuple[str, ...]
    cases: tuple[CaseChange, ...]
    same_noise: bool

    @property
    def comparable(self) -> bool:
        """Whether every case of the base and every gated metric could be compared."""
        refused = any(row.gated and row.verdict == "not comparable" for row in self.rows)
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
    def worse(self) -> bool:
        """Whether a gated metric is worse."""
        return any(row.gated and row.verdict == "worse" for arm in self.arms for row in arm.rows)

    @property
    def exit_code(self) -> int:
        """0 nothing worse, 1 a gate broken, 2 something that is gated could not be compared."""
        if self.worse:
            return 1
        return 0 if all(arm.comparable for arm in self.arms) else 2

    def sentence(self) -> str:
        """The verdict in one sentence."""
        gated = [row for arm in self.arms for row in arm.rows if row.gated]
        named, counted = [], []
        for verdict in ("worse", "better", "equivalent", "inconclusive", "not comparable"):
            rows = [row for row in gated if row.verdict == verdict]
            if rows and verdict in {"worse", "better"}:
                named.append(f"{verdict} in {', '.join(dict.fromkeys(within(row.title) for row in rows))}")
            elif rows:
                counted.append(f"{verdict} in {len(rows)}")
        others = [f"{_listed(counted)} of {len(gated)} gated metrics"] if counted else []
        head = {0: "Nothing gated is worse", 1: "A gate is broken", 2: "Not all of it can be compared"}
        return f"{head[self.exit_code]}: {self.new} against {self.base} is {'; '.join([*named, *others])}."


def _listed(words: Sequence[str]) -> str:
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)
