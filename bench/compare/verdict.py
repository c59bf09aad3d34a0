"""From tests to verdicts: what a difference means for other scenes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from bench.compare.holm import holm, holm_levels
from bench.compare.result import Row, Seen, Verdict
from bench.statistics.flips import FlipTest

ALPHA = 0.05
"""Chance of any false verdict among all gated metrics of a comparison."""


@dataclass(frozen=True)
class Draft:
    """A row that waits for its level; ``test`` is None where a fact has settled it, or nothing could.

    ``scale`` turns the test's number per scene into the row's unit.
    """

    row: Row
    test: FlipTest | None = None
    scale: float = 1.0


def decide(low: float, high: float, *, margin: float, better: Literal["higher", "lower"]) -> Verdict:
    """The verdict on a difference, new minus base; the interval alone says it.

    - *equivalent*: the whole interval lies within the margin. A difference may be certain and yet too small
      to matter; then this is still the word for it.
    - *worse*, *better*: else, when zero is outside the interval.
    - *inconclusive*: else. More scenes would tell.

    Parameters
    ----------
    low, high
        Interval in the metric's unit; NaN where there is nothing to compare.
    margin
        In the metric's unit; with a margin of zero only an interval of no width is equivalent.
    better
        Which direction is better.

    """
    if -margin <= low and high <= margin:
        return "equivalent"
    return seen(low, high, better=better) or "inconclusive"


def seen(low: float, high: float, *, better: Literal["higher", "lower"]) -> Seen:
    """Which way a difference certainly goes, large or small; the parameters are those of :func:`decide`."""
    if low > 0.0 or high < 0.0:
        return "better" if (low > 0.0) == (better == "higher") else "worse"
    return ""


def judged(drafts: Sequence[Draft]) -> list[Row]:
    """Rows with intervals and verdicts. The metrics that a margin gates are one family for Holm's correction.

    Each is tested at the level where Holm's procedure tests it, and its interval is that very test turned
    round at that very level. Rows that a fact has settled, or that cannot be compared, are no tests. Nor are
    those in which no scene differs: no choice of signs could reject there (Tarone, Biometrics 46, 1990).
    """
    family = [draft.test.p() for draft in drafts if draft.row.tested and draft.test and draft.test.speaks]
    p_values = np.array(family, dtype=float)
    corrected = iter(zip(holm(p_values), holm_levels(p_values, ALPHA), strict=True))
    rows = []
    for draft in drafts:
        if draft.test is None or not draft.test.speaks:
            rows.append(_unmoved(draft.row) if draft.test and draft.test.scenes else draft.row)
            continue
        p_holm, level = next(corrected) if draft.row.tested else (draft.test.p(), ALPHA)
        rows.append(_judged(draft, draft.test, float(p_holm), float(level)))
    return rows


def _unmoved(row: Row) -> Row:
    """A metric that is the same in every scene."""
    return replace(row, low=0.0, high=0.0, p=1.0, p_holm=1.0, verdict="equivalent")


def _judged(draft: Draft, test: FlipTest, p_holm: float, level: float) -> Row:
    row = draft.row
    low, high = (draft.scale * end for end in test.interval(level))
    return replace(
        row,
        low=low,
        high=high,
        level=1.0 - level,
        p=test.p(),
        p_holm=p_holm,
        verdict=decide(low, high, margin=row.margin, better=row.better),
        seen=seen(low, high, better=row.better),
    )
