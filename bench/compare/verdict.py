"""From an interval to a verdict."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from bench.compare.holm import holm
from bench.compare.result import Row, Seen, Verdict

ALPHA = 0.05


def decide(
    difference: float, low: float, high: float, *, p: float, margin: float, better: Literal["higher", "lower"]
) -> Verdict:
    """The verdict on a difference, new minus base.

    - *equivalent*: the whole 95 % interval lies within the margin. A difference may be certain and yet too
      small to matter; then this is still the word for it.
    - *worse*, *better*: else, when zero is outside the interval and the p-value, corrected for all gated
      metrics, is at most 0.05.
    - *inconclusive*: else. More scenes would tell.

    Parameters
    ----------
    difference, low, high
        Difference and interval in the metric's unit; NaN where there is nothing to compare.
    p
        Corrected p-value.
    margin
        In the metric's unit; with a margin of zero only an interval of no width is equivalent.
    better
        Which direction is better.

    """
    if -margin <= low and high <= margin:
        return "equivalent"
    return seen(difference, low, high, p=p, better=better) or "inconclusive"


def seen(difference: float, low: float, high: float, *, p: float, better: Literal["higher", "lower"]) -> Seen:
    """Which way a difference certainly goes, large or small; the parameters are those of :func:`decide`."""
    if p > ALPHA or low <= 0.0 <= high or not low <= high:
        return ""
    return "better" if (difference > 0.0) == (better == "higher") else "worse"


def judged(rows: Sequence[Row]) -> list[Row]:
    """Rows with corrected p-values and verdicts. The gated ones are one family for Holm's correction.

    Rows that are settled already, by a fact or because they cannot be compared, are no tests.
    """
    family = [row.p for row in rows if row.gated and _is_test(row)]
    adjusted = iter(holm(np.array(family)).tolist())
    return [_judged(row, adjusted) if _is_test(row) else row for row in rows]


def _judged(row: Row, adjusted: Iterator[float]) -> Row:
    p = next(adjusted) if row.gated else row.p
    ends = (row.difference, row.low, row.high)
    verdict = decide(*ends, p=p, margin=row.margin, better=row.better)
    if verdict == "inconclusive" and row.every:
        verdict = row.every
    return replace(row, p_holm=p, verdict=verdict, seen=seen(*ends, p=p, better=row.better))


def _is_test(row: Row) -> bool:
    return not math.isnan(row.p)
