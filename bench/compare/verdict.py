"""From an interval to a verdict."""

from __future__ import annotations

from typing import Literal

from bench.compare.result import Verdict

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
    if p > ALPHA or low <= 0.0 <= high or not low <= high:
        return "inconclusive"
    return "better" if (difference > 0.0) == (better == "higher") else "worse"
